#pragma once

#include <string>
#include <utility>

#include "scene/files/json_keys.h"

namespace lumi {

// What a program has to say when it is done, made from its summary.
struct Answer {
  JsonKeys keys;
  std::string text;    // for people; empty: nothing
  std::string result;  // a line of it that is printed under --quiet, too: figures that were asked for; empty: nothing

  template <typename Summary>
  requires requires(const Summary& s) { Describe(s); }
  Answer(const Summary& summary) : keys(summary), text(Describe(summary)) {
    if constexpr (requires { ResultLine(summary); }) result = ResultLine(summary);
  }
  Answer(JsonKeys k, std::string t) : keys(std::move(k)), text(std::move(t)) {}
};

}  // namespace lumi
