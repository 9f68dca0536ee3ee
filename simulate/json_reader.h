// Checked access to a JSON tree: every value is asked for by key with its range, every message names the file and the
// place ("objects[3].radius: must be > 0"), and unknown keys are refused, because a misspelt option that is ignored
// looks like one that does nothing.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "scene/program/error.h"

namespace lumi {

class JsonReader {
 public:
  using Json = nlohmann::json;

  JsonReader(const Json& node, std::filesystem::path file, std::string place)
      : node_(node), file_(std::move(file)), place_(std::move(place)) {
    if (!node_.is_object()) Fail("must be an object { ... }");
  }

  [[noreturn]] void Fail(const std::string& what) const { throw InputError(file_, place_ + ": " + what); }
  [[noreturn]] void Fail(const std::string& key, const std::string& what) const {
    throw InputError(file_, Place(key) + ": " + what);
  }

  const std::filesystem::path& file() const { return file_; }
  std::string Place(const std::string& key) const { return place_.empty() ? key : place_ + "." + key; }

  const Json* Find(const std::string& key) {
    asked_.insert(key);
    const auto it = node_.find(key);
    return it == node_.end() || it->is_null() ? nullptr : &*it;
  }
  const Json& Require(const std::string& key) {
    const Json* found = Find(key);
    if (found == nullptr) Fail(key, "is missing");
    return *found;
  }
  bool Has(const std::string& key) { return Find(key) != nullptr; }

  enum class Range { kAny, kPositive, kNotNegative };
  double Number(const std::string& key, double fallback, Range range = Range::kAny);
  double RequireNumber(const std::string& key, Range range = Range::kAny);
  int Integer(const std::string& key, int fallback, int low, int high = std::numeric_limits<int>::max());
  bool Flag(const std::string& key, bool fallback);
  std::string Text(const std::string& key, const std::string& fallback);
  std::string RequireText(const std::string& key);
  std::vector<double> Numbers(const std::string& key, std::size_t count);  // of exactly so many
  Eigen::Vector2d Vector2(const std::string& key, const Eigen::Vector2d& fallback);
  Eigen::Vector3d Vector3(const std::string& key, const Eigen::Vector3d& fallback);
  Eigen::Vector3d RequireVector3(const std::string& key);
  // Elements of an array, with their places ("objects[3]").
  std::vector<std::pair<const Json*, std::string>> Array(const std::string& key);

  // Refuses keys that no call has read.
  void Done() const;

 private:
  double CheckedNumber(const Json& value, const std::string& key, Range range) const;

  const Json& node_;
  std::filesystem::path file_;
  std::string place_;
  std::set<std::string> asked_;
};

}  // namespace lumi
