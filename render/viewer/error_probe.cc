#include "render/viewer/error_probe.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "render/holdout/holdout.h"
#include "render/photos/photo_correction.h"
#include "render/picture/convert.h"
#include "render/settings_json.h"
#include "scene/files/image_io.h"
#include "scene/image_difference/image_difference.h"
#include "scene/model/orientation.h"

namespace lumi {
namespace {

template <typename T>
bool Ready(const std::future<T>& f) {
  return f.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

}  // namespace

void ListKeys(JsonKeys& j, MeasuredError& e) {
  j("photo", e.photo, "psnr_db", e.psnr_db, "ssim", e.ssim, "coverage", e.coverage, "ms", e.ms, "width", e.size_px.x(),
    "height", e.size_px.y(), "settings", e.settings);
}

void ErrorProbe::Start(ViewId view, const RadianceSettings& settings) {
  if (busy()) return;
  view_ = view;
  const View& v = scene_.views[static_cast<std::size_t>(view.value)];
  const Camera& camera = scene_.CameraOf(v);
  const double scale = std::min(1.0, static_cast<double>(kErrorSide) / std::max(camera.width_px, camera.height_px));
  result_ = {};
  result_.photo = v.name;
  result_.settings = settings;
  if (v.time_s) result_.settings.time_s = *v.time_s;
  result_.size_px = {std::max(1, static_cast<int>(std::lround(camera.width_px * scale))),
                     std::max(1, static_cast<int>(std::lround(camera.height_px * scale)))};
  reading_ = std::async(std::launch::async, [file = scene_.ImagePath(v), size = result_.size_px] {
    return Resize(ReadImage8(file, 3), size.x(), size.y());
  });
}

RenderRequest ErrorProbe::Request() const {
  RenderRequest request;
  request.view = PhotosView(scene_, scene_.views[static_cast<std::size_t>(view_.value)], result_.size_px);
  request.settings = result_.settings;
  request.use.assign(scene_.views.size(), true);
  request.use[static_cast<std::size_t>(view_.value)] = false;
  return request;
}

std::optional<MeasuredError> ErrorProbe::Step(double step_ms, bool undisturbed) {
  if (reading_.valid()) {
    if (!Ready(reading_)) return std::nullopt;
    photo_ = reading_.get();
    const RenderRequest request = Request();
    correction_ = request.view.correction;
    painter_.Start(request);
    return std::nullopt;
  }
  if (painter_.busy()) {
    std::optional<ImageF> picture = painter_.Step(step_ms, undisturbed);
    if (!picture) return std::nullopt;
    result_.ms = painter_.picture_ms();
    const View& view = scene_.views[static_cast<std::size_t>(view_.value)];
    comparing_ =
        std::async(std::launch::async, [result = result_, picture = std::move(*picture), photo = std::move(photo_),
                                        correction = correction_, orientation = view.orientation]() mutable {
          if (correction) GiveBack(*correction, picture);
          const Image8 rgb = ToRgb8(picture);
          const ImageDifference d = Compare(rgb, photo);
          result.difference = UprightPicture(DifferenceImage(rgb, photo), orientation);
          result.psnr_db = d.psnr_db;
          result.ssim = d.ssim;
          result.coverage = Coverage(picture);
          return result;
        });
    return std::nullopt;
  }
  if (comparing_.valid() && Ready(comparing_)) return comparing_.get();
  return std::nullopt;
}

}  // namespace lumi
