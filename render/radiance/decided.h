// Options that the user decided, on the command line, in a settings file or through --effects: neither the data's
// evidence nor a budget changes them. A measure is decided by its switch, which bears its name.
#pragma once

#include <initializer_list>
#include <set>
#include <string>
#include <string_view>

namespace lumi {

class Decided {
 public:
  Decided() = default;
  Decided(std::initializer_list<std::string_view> options) { Add(options); }
  void Add(std::string_view option) { options_.emplace(option); }
  void Add(std::initializer_list<std::string_view> options) {
    for (const std::string_view o : options) Add(o);
  }
  bool Has(std::string_view option) const { return options_.find(option) != options_.end(); }
  template <typename M>
  bool Has() const {
    return Has(M::kName);
  }
  const std::set<std::string, std::less<>>& options() const { return options_; }

 private:
  std::set<std::string, std::less<>> options_;
};

}  // namespace lumi
