// What is wrong with a JSON file that somebody wrote by hand: which key, and what it should be. The header does not
// include the JSON library: whoever reads JSON does.
#pragma once

#include <array>
#include <concepts>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

namespace lumi {

// Names the key; the reader adds the file.
struct JsonFault : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// What the library says of a fault, in plain words.
std::string JsonProblem(std::string what);

template <typename T>
std::string JsonKindOf() {
  if constexpr (std::same_as<T, bool>)
    return "true or false";
  else if constexpr (std::integral<T>)
    return "a whole number";
  else if constexpr (std::floating_point<T>)
    return "a number";
  else if constexpr (requires { std::tuple_size<T>::value; })
    return "a list of " + std::to_string(std::tuple_size<T>::value) + " numbers";
  else
    return "a text";
}

// object[key]; `where` stands before the key in what is said: "keys[3].".
template <typename T, typename Json>
T JsonAt(const Json& object, const std::string& key, const std::string& where = {}) {
  if (!object.is_object())
    throw JsonFault((where.empty() ? std::string("it") : where.substr(0, where.find_last_not_of('.') + 1)) +
                    " is no object");
  const auto it = object.find(key);
  if (it == object.end()) throw JsonFault("the key \"" + where + key + "\" is missing");
  if constexpr (std::same_as<T, Json>) {
    return *it;
  } else {
    bool fits = true;
    if constexpr (std::integral<T> && !std::same_as<T, bool>)  // the library itself cuts what does not fit
      fits = it->is_number_unsigned() ? std::in_range<T>(it->template get<std::uint64_t>())
                                      : it->is_number_integer() && std::in_range<T>(it->template get<std::int64_t>());
    if constexpr (std::floating_point<T>) fits = it->is_number();
    if constexpr (requires { std::tuple_size<T>::value; })
      fits = it->is_array() && it->size() >= std::tuple_size<T>::value;
    try {
      if (fits) return it->template get<T>();
    } catch (const typename Json::exception&) {
    }
    throw JsonFault("\"" + where + key + "\" must be " + JsonKindOf<T>());
  }
}
// The same where the key may be missing.
template <typename T, typename Json>
T JsonOr(const Json& object, const std::string& key, T otherwise, const std::string& where = {}) {
  return object.is_object() && object.contains(key) ? JsonAt<T>(object, key, where) : otherwise;
}

}  // namespace lumi
