#include "proxy/silhouettes/grab_cut.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "scene/program/error.h"

namespace lumi {

Image8 SilhouetteFromBox(const Image8& photo, const Eigen::Vector4d& box_px, int iterations) {
  if (photo.channels < 3) throw std::invalid_argument("a photo without colours");
  if (!box_px.allFinite()) throw DataError("the box around the object is not finite");
  const auto clamped = [](double x, int most) {
    return static_cast<int>(std::lround(std::clamp(x, 0.0, static_cast<double>(most))));
  };
  const int left = clamped(box_px[0], photo.width), right = clamped(box_px[2], photo.width);
  const int top = clamped(box_px[1], photo.height), bottom = clamped(box_px[3], photo.height);
  if (right - left < 2 || bottom - top < 2)
    throw DataError("the box around the object holds no pixel of the photo", "give left, top, right, bottom in pixels");
  if (right - left == photo.width && bottom - top == photo.height) {
    throw DataError("the box around the object is the whole photo",
                    "leave some background outside for GrabCut to learn from");
  }
  cv::Mat rgb(photo.height, photo.width, CV_8UC3), mask, background, object;
  for (int y = 0; y < photo.height; ++y) {
    for (int x = 0; x < photo.width; ++x)
      for (int c = 0; c < 3; ++c) rgb.at<cv::Vec3b>(y, x)[c] = photo.At(x, y, c);
  }
  cv::setRNGSeed(0);  // its clusters start at random
  cv::grabCut(rgb, mask, cv::Rect(left, top, right - left, bottom - top), background, object, iterations,
              cv::GC_INIT_WITH_RECT);
  Image8 out(photo.width, photo.height, 1);
  for (int y = 0; y < photo.height; ++y) {
    for (int x = 0; x < photo.width; ++x) {
      const std::uint8_t m = mask.at<std::uint8_t>(y, x);
      out.At(x, y, 0) = m == cv::GC_FGD || m == cv::GC_PR_FGD ? 255 : 0;
    }
  }
  return out;
}

}  // namespace lumi
