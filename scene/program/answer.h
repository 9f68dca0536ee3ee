#pragma once

#include <string>
#include <utility>

#include "scene/files/json_keys.h"

namespace lumi {

// What a program has to say when it is done, made from its summary.
struct Answer {
  JsonKeys keys;
  std::string text;  // for people; empty: nothing

  template <typename Summary>
  requires requires(const Summary& s) { Describe(s); }
  Answer(const Summary& summary) : keys(summary), text(Describe(summary)) {}
  Answer(JsonKeys k, std::string t) : keys(std::move(k)), text(std::move(t)) {}
};

}  // namespace lumi
