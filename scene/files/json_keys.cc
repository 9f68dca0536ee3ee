#include "scene/files/json_keys.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "scene/files/atomic_file.h"
#include "scene/files/json_limits.h"
#include "scene/files/json_problem.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

using Json = nlohmann::ordered_json;

// Whether a number is one that T holds: the library casts, whatever comes of it.
template <typename T>
bool Holds(const Json& value) {
  if constexpr (std::integral<T> && !std::same_as<T, bool>) {
    using Limits = std::numeric_limits<T>;
    if (value.is_number_float()) {  // 2^digits and its negative are exact in double
      const double number = value.get<double>(), beyond = std::ldexp(1.0, Limits::digits);
      return number < beyond && number >= (std::is_signed_v<T> ? -beyond : 0);
    }
    if (value.is_number_unsigned()) return value.get<std::uint64_t>() <= static_cast<std::uint64_t>(Limits::max());
    if (value.is_number_integer()) return std::in_range<T>(value.get<std::int64_t>());
  } else if constexpr (std::same_as<T, std::vector<int>>) {
    if (value.is_array()) return std::all_of(value.begin(), value.end(), Holds<int>);
  }
  return true;  // or of another type, which the library says
}

Json& At(const std::shared_ptr<void>& node) { return *static_cast<Json*>(node.get()); }

}  // namespace

JsonKeys::JsonKeys() : node_(std::make_shared<Json>(Json::object())) {}

std::optional<JsonKeys> JsonKeys::Parse(const std::string& text) {
  if (JsonBeyondLimits(text)) return std::nullopt;
  auto node = std::make_shared<Json>(Json::parse(text, nullptr, false));
  return node->is_object() ? std::optional(JsonKeys(std::move(node), false)) : std::nullopt;
}

JsonKeys JsonKeys::Read(const std::filesystem::path& file, const std::string& what) {
  try {
    auto node = std::make_shared<Json>(Json::parse(ReadJsonText(file, 1 << 24)));
    if (!node->is_object()) throw InputError(file, "not " + what + ": no JSON object");
    return {std::move(node), false};
  } catch (const Json::exception& e) {
    throw InputError(file, "not " + what + ": " + JsonProblem(e.what()));
  }
}

std::string JsonKeys::Text(int indent) const {
  return At(node_).dump(indent, ' ', false, Json::error_handler_t::replace);
}

bool JsonKeys::Has(const char* key) const { return At(node_).contains(key) && !At(node_).at(key).is_null(); }

void JsonKeys::Remove(const char* key) { At(node_).erase(key); }

std::map<std::string, std::string> JsonKeys::Words() const {
  std::map<std::string, std::string> words;
  for (const auto& [key, value] : At(node_).items())
    words[key] = value.is_string() ? value.get<std::string>() : value.dump();
  return words;
}

JsonKeys& JsonKeys::Append(const JsonKeys& other) {
  At(node_).update(At(other.node_));
  return *this;
}

template <JsonValue T>
JsonKeys& JsonKeys::operator()(const char* key, T& value) {
  if (!reading_) {
    At(node_)[key] = value;
  } else if (!Lacks(key)) {
    try {
      const Json& there = At(node_).at(key);
      if (Holds<T>(there))
        value = there.get<T>();
      else
        complete_ = false;
    } catch (const Json::exception&) {  // of another type
      complete_ = false;
    }
  }
  return *this;
}
template JsonKeys& JsonKeys::operator()(const char*, bool&);
template JsonKeys& JsonKeys::operator()(const char*, int&);
template JsonKeys& JsonKeys::operator()(const char*, long&);
template JsonKeys& JsonKeys::operator()(const char*, std::size_t&);
template JsonKeys& JsonKeys::operator()(const char*, double&);
template JsonKeys& JsonKeys::operator()(const char*, std::string&);
template JsonKeys& JsonKeys::operator()(const char*, std::map<std::string, std::string>&);
template JsonKeys& JsonKeys::operator()(const char*, std::map<std::string, std::vector<double>>&);
template JsonKeys& JsonKeys::operator()(const char*, std::vector<int>&);
template JsonKeys& JsonKeys::operator()(const char*, std::vector<double>&);
template JsonKeys& JsonKeys::operator()(const char*, std::vector<std::string>&);

JsonKeys& JsonKeys::operator()(const char* key, std::filesystem::path& value) {
  std::string text = value.string();
  (*this)(key, text);
  if (reading_) value = text;
  return *this;
}

JsonKeys& JsonKeys::operator()(const char* key, JsonKeys& value) {
  if (!reading_)
    At(node_)[key] = At(value.node_);
  else if (!Lacks(key))
    value.node_ = std::make_shared<Json>(At(node_).at(key));
  return *this;
}

JsonKeys& JsonKeys::Null(const char* key) {
  At(node_)[key] = nullptr;
  return *this;
}

bool JsonKeys::Lacks(const char* key) {
  if (!reading_ || Has(key)) return false;
  complete_ = false;
  return true;
}

JsonKeys JsonKeys::Child(const char* key, bool a_list) {
  Json fresh = a_list ? Json::array() : Json::object();
  if (!reading_) return {{node_, &(At(node_)[key] = std::move(fresh))}, false};
  Json& there = At(node_).at(key);
  if (there.type() == fresh.type()) return {{node_, &there}, true};
  complete_ = false;
  return {std::make_shared<Json>(std::move(fresh)), true};
}

JsonKeys JsonKeys::Item(std::size_t i) const {
  if (!reading_) return {{node_, &At(node_).emplace_back(Json::object())}, false};
  return At(node_).at(i).is_object() ? JsonKeys({node_, &At(node_).at(i)}, true)
                                     : JsonKeys(std::make_shared<Json>(Json::object()), true);
}

std::size_t JsonKeys::size() const { return At(node_).size(); }

}  // namespace lumi
