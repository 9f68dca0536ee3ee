// A number that varies slowly over a photo, such as how sharp it is: cells row by row from the top left, bilinear
// between their centres, constant beyond.
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace lumi {

struct PhotoGrid {
  int columns = 1, rows = 1;
  std::vector<float> value = {1.0F};

  // At fractions of the photo's width and height.
  float At(float u, float v) const {
    const auto place = [](float share, int count) {
      return std::clamp(share * static_cast<float>(count) - 0.5F, 0.0F, static_cast<float>(count - 1));
    };
    const float x = place(u, columns), y = place(v, rows);
    const int x0 = static_cast<int>(x), y0 = static_cast<int>(y), x1 = std::min(x0 + 1, columns - 1),
              y1 = std::min(y0 + 1, rows - 1);
    const float a = x - static_cast<float>(x0), b = y - static_cast<float>(y0);
    const auto at = [&](int column, int row) { return value[static_cast<std::size_t>(row * columns + column)]; };
    return (1 - b) * ((1 - a) * at(x0, y0) + a * at(x1, y0)) + b * ((1 - a) * at(x0, y1) + a * at(x1, y1));
  }
};

// By the name of what they are about; grids of one name have one size in all views of a scene.
using PhotoGrids = std::map<std::string, PhotoGrid, std::less<>>;

}  // namespace lumi
