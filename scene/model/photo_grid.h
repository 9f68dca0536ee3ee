// A number that varies slowly over a photo, such as how sharp it is: cells row by row, bilinear between their centres.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

namespace lumi {

struct PhotoGrid {
  int columns = 1, rows = 1;
  std::vector<float> value = {1.0F};
};

// By the name of what they are about; grids of one name have one size in all views of a scene.
using PhotoGrids = std::map<std::string, PhotoGrid, std::less<>>;

}  // namespace lumi
