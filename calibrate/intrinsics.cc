#include "calibrate/intrinsics.h"

#include <algorithm>

namespace lumi {

Eigen::Vector2d ProjectNormalized(const Intrinsics& k, const Eigen::Vector2d& x) {
  Eigen::Vector2d pixel;
  ProjectNormalized(k.data(), x.x(), x.y(), pixel.data());
  return pixel;
}

Camera CameraOf(const Intrinsics& k, int width_px, int height_px) {
  return {CameraModel::kPlumbBob,
          width_px,
          height_px,
          {k[kFx], k[kFx] * k[kAspect], k[kCx], k[kCy], k[kSkew], k[kK1], k[kK2], k[kP1], k[kP2], k[kK3]}};
}

std::optional<Eigen::Vector2d> Unproject(const Intrinsics& k, const Eigen::Vector2d& pixel) {
  return CameraOf(k, 1, 1).Normalized(pixel);
}

int LensModel::FreeCount() const { return static_cast<int>(std::ranges::count(free, true)); }

std::vector<LensModel> LensModels(bool fixed_aspect) {
  struct Part {
    const char* name;
    std::vector<int> terms;
  };
  static const std::vector<Part> pixels = {{"square", {}}, {"rect", {kAspect}}, {"skew", {kAspect, kSkew}}};
  static const std::vector<Part> distortions = {{"none", {}},
                                                {"k1", {kK1}},
                                                {"k1k2", {kK1, kK2}},
                                                {"k1k2p", {kK1, kK2, kP1, kP2}},
                                                {"k1k2k3", {kK1, kK2, kK3}},
                                                {"k1k2pk3", {kK1, kK2, kP1, kP2, kK3}}};
  std::vector<LensModel> models;
  for (const Part& p : pixels) {
    if (fixed_aspect && p.name != std::string("square")) continue;
    for (const Part& d : distortions) {
      LensModel model{std::string(p.name) + "-" + d.name, {}};
      for (const int term : {static_cast<int>(kFx), static_cast<int>(kCx), static_cast<int>(kCy)})
        model.free[static_cast<std::size_t>(term)] = true;
      for (const int term : p.terms) model.free[static_cast<std::size_t>(term)] = true;
      for (const int term : d.terms) model.free[static_cast<std::size_t>(term)] = true;
      models.push_back(model);
    }
  }
  std::ranges::stable_sort(models,
                           [](const LensModel& a, const LensModel& b) { return a.FreeCount() < b.FreeCount(); });
  return models;
}

std::optional<LensModel> LensModelFromName(const std::string& name) {
  const std::string wanted = name == "thesis" ? "skew-k1k2" : name;
  for (const LensModel& model : LensModels())
    if (model.name == wanted) return model;
  return std::nullopt;
}

LensModel FullestModel(bool fixed_aspect) { return LensModels(fixed_aspect).back(); }

}  // namespace lumi
