// Values of a JSON object by name; a value that is not what it should be is refused by its name. Inside scene/files
// only.
#pragma once

#include <fmt/format.h>

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "scene/files/atomic_file.h"
#include "scene/files/json_limits.h"
#include "scene/files/json_problem.h"
#include "scene/program/error.h"

namespace lumi::json_fields {

using Json = nlohmann::ordered_json;

// Reads values of an object by name and says which one is wrong.
class Fields {
 public:
  Fields(const Json& object, const std::filesystem::path& file, std::string where)
      : object_(object), file_(file), where_(std::move(where)) {
    if (!object.is_object()) throw InputError(file, where_ + " is no object");
  }
  const Json* Find(const char* key) const {
    const auto it = object_.find(key);
    return it == object_.end() || it->is_null() ? nullptr : &*it;
  }
  InputError Wrong(const char* key, const char* expected) const {
    return Find(key) != nullptr ? InputError(file_, fmt::format("{}{} is not {}", where_, key, expected))
                                : InputError(file_, fmt::format("the key \"{}{}\" is missing", where_, key));
  }

  std::optional<double> Number(const char* key) const {
    const Json* value = Find(key);
    if (!value) return std::nullopt;
    if (!value->is_number() || !std::isfinite(value->get<double>())) throw Wrong(key, "a number");
    return value->get<double>();
  }
  std::optional<int> Integer(const char* key) const {
    const Json* value = Find(key);
    if (!value) return std::nullopt;
    if (!value->is_number_integer()) throw Wrong(key, "a whole number");
    const auto number = value->get<std::int64_t>();
    if (number < 0 || number > std::numeric_limits<int>::max()) throw Wrong(key, "a whole number in its range");
    return static_cast<int>(number);
  }
  std::optional<std::string> Text(const char* key) const {
    const Json* value = Find(key);
    if (!value) return std::nullopt;
    if (!value->is_string()) throw Wrong(key, "a text");
    return value->get<std::string>();
  }
  template <int n>
  std::optional<Eigen::Matrix<double, n, 1>> Vector(const char* key) const {
    const Json* value = Find(key);
    if (!value) return std::nullopt;
    if (!value->is_array() || value->size() != n) throw Wrong(key, "an array of the right length");
    Eigen::Matrix<double, n, 1> v;
    for (int i = 0; i < n; ++i) {
      const Json& x = (*value)[static_cast<std::size_t>(i)];
      if (!x.is_number() || !std::isfinite(x.get<double>())) throw Wrong(key, "made of numbers");
      v[i] = x.get<double>();
    }
    return v;
  }
  const Json* Array(const char* key) const {
    const Json* value = Find(key);
    if (value && !value->is_array()) throw Wrong(key, "an array");
    return value;
  }

 private:
  const Json& object_;
  const std::filesystem::path& file_;
  std::string where_;
};

// The opening of each of our files: "format" and "version". `not_it`: "is no manifest of a lumigraph".
inline void RequireFormat(const Fields& fields, const std::filesystem::path& file, const char* format, int version,
                          const char* not_it) {
  if (fields.Text("format").value_or("") != format)
    throw InputError(file, fmt::format("{}: format is missing or another", not_it));
  const auto found = fields.Integer("version");
  if (!found || *found < 1) throw InputError(file, "has no version");
  if (*found > version)
    throw InputError(file, fmt::format("has format version {}, this program reads up to {}", *found, version),
                     "install a newer version of this suite");
}

inline Json ParseJson(const std::filesystem::path& file) {
  try {
    return Json::parse(ReadJsonText(file));
  } catch (const nlohmann::json::exception& e) {
    throw InputError(file, "is " + JsonProblem(e.what()));
  }
}

}  // namespace lumi::json_fields
