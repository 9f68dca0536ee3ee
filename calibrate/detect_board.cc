#include "calibrate/detect_board.h"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "scene/files/opencv_pixels.h"

namespace lumi {
namespace {

constexpr int kLeastSeen = 3;  // columns and rows of the smallest piece of a board that is recognised as one
constexpr int kLeastSidePx = 32;
// cornerSubPix interpolates linearly between pixels, which moves corners of sharp pictures by up to a twentieth of a
// pixel, by where in its pixel a corner lies. Softened, ray-traced boards' corners are off by a quarter less, and real
// ones fit better.
constexpr double kSoftening = 0.2, kMostSofteningPx = 1;  // Gaussian's sigma: share of the window, and at most
constexpr double kSearchSidePx =
    1600;  // boards are searched in pictures no larger: the refinement works on the photo itself
constexpr double kNameSidePx = 480;  // boards of other sizes are sought in pictures no larger than this

cv::Mat Shrunk(const cv::Mat& grey, double side_px) {
  const double scale = side_px / std::max(grey.cols, grey.rows);
  if (scale >= 1) return grey;
  cv::Mat small;
  cv::resize(grey, small, {}, scale, scale, cv::INTER_AREA);
  return small;
}

// A grey picture that shares no memory with `picture`.
cv::Mat Grey(const Image8& picture) {
  const cv::Mat all(picture.height, picture.width, CV_8UC(picture.channels),
                    const_cast<std::uint8_t*>(picture.data.data()));
  cv::Mat grey;
  if (picture.channels == 1)
    grey = all.clone();
  else
    cv::cvtColor(all, grey, picture.channels == 4 ? cv::COLOR_RGBA2GRAY : cv::COLOR_RGB2GRAY);
  return grey;
}

// Half the distance of neighbouring corners, which is as far as cornerSubPix may look.
int SubPixelWindow(const std::vector<cv::Point2f>& corners, const Board& board) {
  double nearest = 1e9;
  for (int j = 0; j < board.rows; ++j)
    for (int i = 0; i < board.columns; ++i) {
      const auto at = [&](int c, int r) { return corners[static_cast<std::size_t>(r * board.columns + c)]; };
      if (i > 0) nearest = std::min(nearest, cv::norm(at(i, j) - at(i - 1, j)));
      if (j > 0) nearest = std::min(nearest, cv::norm(at(i, j) - at(i, j - 1)));
    }
  return std::clamp(static_cast<int>(0.4 * nearest), 2, 11);
}

// The size of whatever checkerboard is in the picture; 0x0: none.
cv::Size SeenSize(const cv::Mat& grey) {
  std::vector<cv::Point2f> corners;
  cv::Mat meta;
  if (!cv::findChessboardCornersSB(Shrunk(grey, kNameSidePx), {kLeastSeen, kLeastSeen}, corners,
                                   cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_LARGER, meta))
    return {};
  return {std::max(meta.cols, meta.rows), std::min(meta.cols, meta.rows)};
}

}  // namespace

BoardSearch FindBoard(const Image8& picture, const Board& board, int corner_window_px) {
  BoardSearch search;
  search.why_not = fmt::format("no {}x{} board is wholly in the picture", board.columns, board.rows);
  if (std::min(picture.width, picture.height) < kLeastSidePx) return search;
  const cv::Mat grey = Grey(picture);
  const cv::Size size(board.columns, board.rows);
  std::vector<cv::Point2f> corners;
  try {
    const cv::Mat searched = Shrunk(grey, kSearchSidePx);
    bool found = cv::findChessboardCornersSB(searched, size, corners, cv::CALIB_CB_NORMALIZE_IMAGE);
    if (!found) {
      const cv::Size seen = SeenSize(grey);
      const int longer = std::max(board.columns, board.rows), shorter = std::min(board.columns, board.rows);
      // The older detector takes a part of a larger board for the whole: it is not asked then.
      if (seen.width <= longer && seen.height <= shorter)
        found = cv::findChessboardCorners(
            searched, size, corners,
            cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_FAST_CHECK);
      if (!found && seen.width > 0 && (seen.width != longer || seen.height != shorter)) {
        search.seen_columns = seen.width;
        search.seen_rows = seen.height;
        search.why_not =
            fmt::format("{}x{} corners are seen, not {}x{}", seen.width, seen.height, board.columns, board.rows);
      }
    }
    if (found && corners.size() == static_cast<std::size_t>(board.CornerCount())) {
      const float x_scale = static_cast<float>(grey.cols) / static_cast<float>(searched.cols);
      const float y_scale = static_cast<float>(grey.rows) / static_cast<float>(searched.rows);
      for (cv::Point2f& c : corners) c = {(c.x + 0.5F) * x_scale - 0.5F, (c.y + 0.5F) * y_scale - 0.5F};
      const int window = corner_window_px > 0 ? corner_window_px : SubPixelWindow(corners, board);
      cv::Mat refined = grey;
      if (corner_window_px == 0) cv::GaussianBlur(grey, refined, {}, std::min(kMostSofteningPx, kSoftening * window));
      cv::cornerSubPix(refined, corners, {window, window}, {-1, -1},
                       {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 60, 1e-4});
    }
    if (!found || corners.size() != static_cast<std::size_t>(board.CornerCount())) return search;

    FoundBoard result;
    for (const cv::Point2f& c : corners) result.corners_px.push_back(FromOpenCvPixel(Eigen::Vector2d(c.x, c.y)));
    // A checkerboard and its mirror image look the same: the right-handed order is taken.
    const auto n = static_cast<std::size_t>(board.columns);
    const Eigen::Vector2d across = result.corners_px[n - 1] - result.corners_px[0],
                          down = result.corners_px[result.corners_px.size() - n] - result.corners_px[0];
    if (across.x() * down.y() - across.y() * down.x() < 0)
      for (std::size_t row = 0; row < result.corners_px.size(); row += n)
        std::reverse(result.corners_px.begin() + static_cast<std::ptrdiff_t>(row),
                     result.corners_px.begin() + static_cast<std::ptrdiff_t>(row + n));
    const cv::Scalar sharpness = cv::estimateChessboardSharpness(grey, size, corners);
    result.edge_width_px = sharpness[0];
    search.found = std::move(result);
    search.why_not.clear();
  } catch (const cv::Exception&) {
    // Its detectors assert on some pictures without a board (no gradients, too few pixels): nothing found.
  }
  return search;
}

double Sharpness(const Image8& picture) {
  cv::Mat grey = Grey(picture), half, laplacian;
  cv::resize(grey, half, {}, 0.5, 0.5, cv::INTER_AREA);
  cv::Laplacian(half, laplacian, CV_32F);
  cv::Scalar mean, spread, l_mean, l_spread;
  cv::meanStdDev(half, mean, spread);
  cv::meanStdDev(laplacian, l_mean, l_spread);
  return spread[0] > 0 ? l_spread[0] * l_spread[0] / (spread[0] * spread[0]) : 0;
}

}  // namespace lumi
