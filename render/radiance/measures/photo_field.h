// What one measure reads off the photos: their PhotoGrids (scene/model/photo_grid.h) one after another, in the order of
// the sources' views.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace lumi {

struct PhotoField {
  int columns = 1, rows = 1;
  std::vector<float> value;  // empty: nothing is known, which reads as 1

  std::span<const float> Of(std::int32_t view) const {
    static constexpr float kUnknown[] = {1.0F};
    const auto cells = static_cast<std::size_t>(columns * rows);
    return value.empty() ? std::span<const float>(kUnknown)
                         : std::span(value).subspan(static_cast<std::size_t>(view) * cells, cells);
  }
};

}  // namespace lumi
