#include "pipeline/report/contact_sheet.h"

#include <algorithm>
#include <cmath>

#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/files/temporary_folder.h"
#include "scene/model/orientation.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

constexpr int kGapPx = 6;
constexpr int kThumbnailQuality = 82;

}  // namespace

std::vector<SheetThumbnails> MakeThumbnails(const std::vector<SheetRow>& rows, int width_px, ProgressSink& progress) {
  const TemporaryFolder temporary;
  std::vector<SheetThumbnails> thumbnails(rows.size());
  Progress task(progress, "thumbnails", static_cast<long>(rows.size()));
  ParallelEach(rows.size(), 1, [&](std::size_t i) {
    SheetThumbnails& row = thumbnails[i];
    row.name = rows[i].name;
    try {
      for (const fs::path& file : {rows[i].photo, rows[i].render, rows[i].difference}) {
        if (file.empty()) continue;
        const Image8 full = UprightPicture(ReadImage8(file), rows[i].orientation);
        const int height =
            std::max(1, static_cast<int>(std::lround(static_cast<double>(width_px) * full.height / full.width)));
        row.pictures.push_back(Resize(full, width_px, height));
        const fs::path jpeg =
            temporary.path() / (std::to_string(i) + "-" + std::to_string(row.pictures.size()) + ".jpg");
        WriteImage(jpeg, row.pictures.back(), kThumbnailQuality);
        row.jpegs.push_back(ReadText(jpeg));
      }
    } catch (const InputError&) {
      row = {};
    }
    task.Step();
  });
  std::erase_if(thumbnails, [](const SheetThumbnails& row) { return row.pictures.empty(); });
  return thumbnails;
}

Image8 ComposeSheet(const std::vector<SheetThumbnails>& rows, int columns) {
  // Pictures in reading order; rows of photo, render and difference are a row each.
  std::vector<const Image8*> cells;
  std::size_t a_row = 1;
  for (const SheetThumbnails& row : rows) a_row = std::max(a_row, row.pictures.size());
  const auto across = a_row > 1 ? a_row : static_cast<std::size_t>(std::max(1, columns));
  int cell_width = 1, cell_height = 1;
  for (const SheetThumbnails& row : rows) {
    for (std::size_t k = 0; k < a_row; ++k) cells.push_back(k < row.pictures.size() ? &row.pictures[k] : nullptr);
    for (const Image8& picture : row.pictures) {
      cell_width = std::max(cell_width, picture.width);
      cell_height = std::max(cell_height, picture.height);
    }
  }
  const auto down = (cells.size() + across - 1) / across;
  Image8 sheet(kGapPx + static_cast<int>(across) * (cell_width + kGapPx),
               kGapPx + static_cast<int>(down) * (cell_height + kGapPx), 3, 255);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (!cells[i]) continue;
    const Image8& picture = *cells[i];
    const int x0 = kGapPx + static_cast<int>(i % across) * (cell_width + kGapPx) + (cell_width - picture.width) / 2;
    const int y0 = kGapPx + static_cast<int>(i / across) * (cell_height + kGapPx) + (cell_height - picture.height) / 2;
    for (int y = 0; y < picture.height; ++y)
      std::copy(picture.Row(y), picture.Row(y) + picture.width * 3, sheet.Row(y0 + y) + x0 * 3);
  }
  return sheet;
}

}  // namespace lumi
