// A struct's keys in JSON, named once: the same list writes the struct and reads it. Who lists keys does not include
// the JSON library.
//
//   struct HullFigures { double iou_median = 0; std::vector<Refused> left_out; };
//   void ListKeys(JsonKeys& j, HullFigures& s) { j("iou_median", s.iou_median, "views_left_out", s.left_out); }
//
//   const std::string text = JsonKeys(figures).Text();
//   auto again = JsonKeys::Parse(text)->As<HullFigures>();
//
// Reading takes what is there: a key that is missing, null or of another type leaves its member as it was (Into says
// so).
#pragma once

#include <Eigen/Core>
#include <array>
#include <concepts>
#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

namespace lumi {

template <typename T, typename... Types>
concept OneOf = (std::same_as<T, Types> || ...);
template <typename T>
concept JsonValue =
    OneOf<T, bool, int, long, std::size_t, double, std::string, std::map<std::string, std::string>,
          std::map<std::string, std::vector<double>>, std::vector<int>, std::vector<double>, std::vector<std::string>>;

class JsonKeys {
 public:
  JsonKeys();  // an empty object to be written
  template <typename T>
  requires(!OneOf<T, JsonKeys>) explicit JsonKeys(const T& summary) : JsonKeys() {
    ListKeys(*this, const_cast<T&>(summary));  // writing changes nothing
  }
  // Text of an object; none where it is not one.
  static std::optional<JsonKeys> Parse(const std::string& text);
  // That of a file of at most 16 MiB. Throws InputError: "not " `what`, and why.
  static JsonKeys Read(const std::filesystem::path& file, const std::string& what);
  // All keys in one line, or as many blanks a level. What is not UTF-8 is replaced.
  std::string Text(int indent = -1) const;
  // Whether every key was there and of its type.
  template <typename T>
  bool Into(T& summary) const {
    JsonKeys reading(node_, true);
    ListKeys(reading, summary);
    return reading.complete_;
  }
  template <typename T>
  T As() const {
    T summary;
    Into(summary);
    return summary;
  }
  bool reading() const { return reading_; }
  bool Has(const char* key) const;  // and it is not null
  void Remove(const char* key);
  // Every key's value: a text's own words, else as JSON has it.
  std::map<std::string, std::string> Words() const;
  // The keys of another one, after these.
  JsonKeys& Append(const JsonKeys& other);

  // A value, an object or a list. An optional without a value is null, as is a number that is not finite.
  template <JsonValue T>
  JsonKeys& operator()(const char* key, T& value);
  JsonKeys& operator()(const char* key, std::filesystem::path& value);
  JsonKeys& operator()(const char* key, JsonKeys& value);  // of another program, handed on as it came
  template <int n>
  JsonKeys& operator()(const char* key, Eigen::Matrix<double, n, 1>& v) {
    return Row<double>(key, v);
  }
  template <typename T, std::size_t n>
  JsonKeys& operator()(const char* key, std::array<T, n>& v) {
    return Row<std::conditional_t<std::integral<T>, int, T>>(key, v);
  }
  template <typename T>
  JsonKeys& operator()(const char* key, std::optional<T>& value) {
    return !reading_ && !value ? Null(key) : IfAny(key, value);
  }
  template <typename T>
  requires(!JsonValue<std::vector<T>>) JsonKeys& operator()(const char* key, std::vector<T>& list) {
    if (Lacks(key)) return *this;
    JsonKeys items = Child(key, true);
    if (reading_) list.resize(items.size());
    for (std::size_t i = 0; i < list.size(); ++i) {
      JsonKeys item = items.Item(i);
      ListKeys(item, list[i]);
      complete_ = complete_ && item.complete_;
    }
    return *this;
  }
  template <typename T>
  requires(!JsonValue<T>) JsonKeys& operator()(const char* key, T& object) {
    if (Lacks(key)) return *this;
    JsonKeys child = Child(key, false);
    ListKeys(child, object);
    complete_ = complete_ && child.complete_;
    return *this;
  }

  // Several of them.
  template <typename T, typename... More>
  requires(sizeof...(More) > 1) JsonKeys& operator()(const char* key, T& value, More&&... more) {
    return (*this)(key, value)(more...);
  }

  // The key is there only where there is something to say.
  template <typename T>
  JsonKeys& IfAny(const char* key, std::optional<T>& value) {
    if (reading_ ? !Has(key) : !value) return *this;
    return (*this)(key, value ? *value : value.emplace());
  }
  template <typename T>
  JsonKeys& IfAny(const char* key, T& list) {
    return (reading_ ? !Has(key) : list.empty()) ? *this : (*this)(key, list);
  }
  // What follows from other members: written only.
  template <typename T>
  JsonKeys& Say(const char* key, const T& value) {
    using Copy =
        std::conditional_t<std::constructible_from<std::string, T> && !OneOf<T, std::filesystem::path>, std::string, T>;
    if (reading_) return *this;
    Copy copy(value);
    return (*this)(key, copy);
  }

 private:
  JsonKeys(std::shared_ptr<void> node, bool reading) : node_(std::move(node)), reading_(reading) {}
  JsonKeys& Null(const char* key);
  bool Lacks(const char* key);                   // what is read; then it is not complete
  JsonKeys Child(const char* key, bool a_list);  // what is read where it is such a one, else a new one
  JsonKeys Item(std::size_t i) const;            // of a list; of a list to be written a new one at its end
  std::size_t size() const;
  template <typename T, typename V>
  JsonKeys& Row(const char* key, V& v) {
    std::vector<T> values(v.begin(), v.end());
    (*this)(key, values);
    for (std::size_t i = 0; reading_ && i < values.size() && i < static_cast<std::size_t>(v.size()); ++i)
      v[i] = values[i];
    return *this;
  }

  std::shared_ptr<void> node_;  // the library's value: a part of what it is in, or the whole
  bool reading_ = false, complete_ = true;
};

}  // namespace lumi
