// A FramePlan says, for one desired view, which cameras are blended where and with which weights; CPU, GL and viewer
// only blend it. No GL, no threads, no files here: callers plan windows of the view in parallel.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "render/radiance/optimum/optimum.h"
#include "render/radiance/proxy_tracer.h"
#include "render/radiance/ray_method.h"
#include "render/radiance/settings.h"
#include "render/radiance/sources.h"
#include "render/radiance/weights.h"

namespace lumi {

struct PixelWindow {
  int x = 0, y = 0, width = 0, height = 0;
};

// Everything that does not depend on the pixel, made once per frame.
struct ViewSetup {
  RenderView desired;  // normalised frame
  RelativeSources sources;
  RadianceSettings settings;
  Eigen::Matrix3d ray_from_pixel;           // direction (not unit) of the ray through (x, y, 1)
  float focal_px = 0;                       // of the desired view, for pyramid levels
  std::shared_ptr<const RayMethod> method;  // what settings.method names; none: this core's own weights
};

// `desired` in world; throws std::invalid_argument for a view whose rays are undefined (singular P).
ViewSetup MakeViewSetup(const Sources& sources, const RenderView& desired, const RadianceSettings& settings,
                        const std::vector<bool>& use = {});

// One sample a pixel of the window, row by row.
struct FramePlan {
  PixelWindow window;
  int k = 0;  // entries a sample; where settings.k is 0, or for the optimum, as many as the longest row has
  std::vector<Eigen::Vector3f> offset;  // proxy point - desired centre, normalised units; undefined where alpha = 0
  std::vector<Eigen::Vector3f>
      normal;                // of the proxy there, unit; none where neither resolution nor prefiltering asks for it
  std::vector<float> alpha;  // 0: hole
  std::vector<std::int32_t> camera;  // samples x k, -1 past the last
  std::vector<float> weight;         // samples x k; the optimum's may be negative, and sum to 1 all the same
  OptimumCounts optimum;             // of this window
};

// Reuses the plan's memory. `visibility`: nullptr where it is off. Pixel centres at (x + 0.5, y + 0.5).
void PlanPixels(const ViewSetup& setup, const ProxyTracer& proxy, const VisibilityMaps* visibility,
                const PixelWindow& window, FramePlan& plan, WeighScratch& scratch);

}  // namespace lumi
