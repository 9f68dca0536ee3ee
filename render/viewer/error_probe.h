// Measures the error of the current settings: a photo's own view, rendered without that photo, compared with it.
#pragma once

#include <future>
#include <memory>
#include <optional>
#include <string>

#include "render/viewer/strip_painter.h"
#include "scene/files/json_keys.h"
#include "scene/model/image.h"
#include "scene/model/scene.h"

namespace lumi {

struct MeasuredError {
  std::string photo;
  Eigen::Vector2i size_px = Eigen::Vector2i::Zero();  // the photo's, halved until at most kErrorSide
  double psnr_db = 0, ssim = 0;                       // over all pixels, a hole counts as black
  double coverage = 0;
  double ms = 0;              // to draw it
  RadianceSettings settings;  // settings that were measured
  Image8 difference;          // |picture - photo|, four times, upright
};

void ListKeys(JsonKeys& j, MeasuredError& e);

constexpr int kErrorSide = 1024;  // larger photos are compared smaller

class ErrorProbe {
 public:
  ErrorProbe(const Scene& scene, GlLumigraph& lumigraph) : scene_(scene), painter_(lumigraph) {}

  // The photo is read and compared on other threads.
  void Start(ViewId view, const RadianceSettings& settings);
  bool busy() const { return reading_.valid() || painter_.busy() || comparing_.valid(); }
  bool drawing() const { return painter_.busy(); }
  RenderRequest Request() const;  // of the picture that is compared
  void Cancel() { painter_.Cancel(); }

  // As StripPainter::Step; returns the result once. Throws InputError for a photo that cannot be read, and what Begin
  // throws.
  std::optional<MeasuredError> Step(double step_ms, bool undisturbed);

 private:
  const Scene& scene_;
  StripPainter painter_;
  ViewId view_;
  MeasuredError result_;
  Image8 photo_;
  std::shared_ptr<const PhotoCorrection> correction_;  // of that photo
  std::future<Image8> reading_;
  std::future<MeasuredError> comparing_;
};

}  // namespace lumi
