#include "simulate/json_reader.h"

#include <cmath>

namespace lumi {

double JsonReader::CheckedNumber(const Json& value, const std::string& key, Range range) const {
  if (!value.is_number()) Fail(key, "must be a number");
  const double number = value.get<double>();
  if (!std::isfinite(number)) Fail(key, "must be finite");
  if (range == Range::kPositive && !(number > 0)) Fail(key, "must be > 0");
  if (range == Range::kNotNegative && number < 0) Fail(key, "must be >= 0");
  return number;
}

double JsonReader::Number(const std::string& key, double fallback, Range range) {
  const Json* value = Find(key);
  return value == nullptr ? fallback : CheckedNumber(*value, key, range);
}

double JsonReader::RequireNumber(const std::string& key, Range range) {
  return CheckedNumber(Require(key), key, range);
}

int JsonReader::Integer(const std::string& key, int fallback, int low, int high) {
  const Json* value = Find(key);
  if (value == nullptr) return fallback;
  if (!value->is_number_integer()) Fail(key, "must be a whole number");
  const double number = value->get<double>();
  if (number < low) Fail(key, "must be >= " + std::to_string(low));
  if (number > high) Fail(key, "must be <= " + std::to_string(high));
  return static_cast<int>(number);
}

bool JsonReader::Flag(const std::string& key, bool fallback) {
  const Json* value = Find(key);
  if (value == nullptr) return fallback;
  if (!value->is_boolean()) Fail(key, "must be true or false");
  return value->get<bool>();
}

std::string JsonReader::Text(const std::string& key, const std::string& fallback) {
  const Json* value = Find(key);
  if (value == nullptr) return fallback;
  if (!value->is_string()) Fail(key, "must be a text in quotes");
  return value->get<std::string>();
}

std::string JsonReader::RequireText(const std::string& key) {
  Require(key);
  return Text(key, "");
}

std::vector<double> JsonReader::Numbers(const std::string& key, std::size_t count) {
  const Json& value = Require(key);
  if (!value.is_array() || value.size() != count) Fail(key, "must be " + std::to_string(count) + " numbers [ ... ]");
  std::vector<double> numbers;
  for (const Json& element : value) numbers.push_back(CheckedNumber(element, key, Range::kAny));
  return numbers;
}

Eigen::Vector2d JsonReader::Vector2(const std::string& key, const Eigen::Vector2d& fallback) {
  if (!Has(key)) return fallback;
  const auto n = Numbers(key, 2);
  return {n[0], n[1]};
}

Eigen::Vector3d JsonReader::Vector3(const std::string& key, const Eigen::Vector3d& fallback) {
  return Has(key) ? RequireVector3(key) : fallback;
}

Eigen::Vector3d JsonReader::RequireVector3(const std::string& key) {
  const auto n = Numbers(key, 3);
  return {n[0], n[1], n[2]};
}

std::vector<std::pair<const JsonReader::Json*, std::string>> JsonReader::Array(const std::string& key) {
  std::vector<std::pair<const Json*, std::string>> elements;
  const Json* value = Find(key);
  if (value == nullptr) return elements;
  if (!value->is_array()) Fail(key, "must be an array [ ... ]");
  for (std::size_t i = 0; i < value->size(); ++i)
    elements.emplace_back(&(*value)[i], Place(key) + "[" + std::to_string(i) + "]");
  return elements;
}

void JsonReader::Done() const {
  for (const auto& [key, value] : node_.items()) {
    if (asked_.count(key) != 0) continue;
    std::string known;
    for (const std::string& name : asked_) known += (known.empty() ? "" : ", ") + name;
    throw InputError(file_, Place(key) + ": unknown key", "known here: " + known);
  }
}

}  // namespace lumi
