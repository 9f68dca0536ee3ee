// Part i of n of work that processes divide, perhaps on several machines: --shard i/n.
#pragma once

#include <cstddef>
#include <string>

namespace lumi {

struct Part {
  int index = 0, count = 1;

  // Of n things in their order: parts are consecutive and of about equal length.
  struct Range {
    std::size_t begin = 0, end = 0;
  };
  Range RangeOf(std::size_t n) const;
};
// "i/n", i from 0. Throws UsageError.
Part PartFrom(const std::string& text);

// Which of `count` parts has thing i of n.
int PartWith(std::size_t i, std::size_t n, int count);

}  // namespace lumi
