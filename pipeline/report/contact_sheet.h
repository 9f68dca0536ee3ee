// Small pictures of the held-out photos beside what was rendered in their place, for the page and as one JPEG.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "scene/model/image.h"
#include "scene/program/progress.h"

namespace lumi {

// Files of one row; render and difference are empty where nothing was held out.
struct SheetRow {
  std::string name;
  std::filesystem::path photo, render, difference;
  int orientation = 1;  // of all three, as they are stored: thumbnails are upright
};

struct SheetThumbnails {
  std::string name;
  std::vector<Image8> pictures;    // photo (, render, difference), of one size
  std::vector<std::string> jpegs;  // the same, encoded
};

// In parallel. A file that cannot be read leaves its row out: a report is not worth failing for.
std::vector<SheetThumbnails> MakeThumbnails(const std::vector<SheetRow>& rows, int width_px, ProgressSink& progress);

// Rows of pictures on a white sheet with gaps; photos alone are set `columns` a row.
Image8 ComposeSheet(const std::vector<SheetThumbnails>& rows, int columns);

}  // namespace lumi
