#include "scene/program/part.h"

#include <optional>
#include <string_view>

#include "scene/program/error.h"
#include "scene/program/whole_number.h"

namespace lumi {

Part PartFrom(const std::string& text) {
  const std::size_t slash = text.find('/');
  const auto index = WholeNumber(std::string_view(text).substr(0, slash));
  const auto count = slash == std::string::npos ? std::nullopt : WholeNumber(std::string_view(text).substr(slash + 1));
  if (!index || !count || *index >= *count) throw UsageError("--shard takes i/n, from 0/n to n-1/n; not " + text);
  return {*index, *count};
}

Part::Range Part::RangeOf(std::size_t n) const {
  const auto i = static_cast<std::size_t>(index), all = static_cast<std::size_t>(count);
  return {i * n / all, (i + 1) * n / all};
}

int PartWith(std::size_t i, std::size_t n, int count) {
  // Thing i is at or behind floor(p n / count) exactly where p n < (i + 1) count.
  return static_cast<int>(((i + 1) * static_cast<std::size_t>(count) - 1) / n);
}

}  // namespace lumi
