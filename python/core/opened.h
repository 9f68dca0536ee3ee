// A lumigraph as Python holds it: what lumi-render does with one view, as numbers. One call at a time works on it;
// others, from other threads, wait.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "render/lumigraph/lumigraph.h"
#include "render/lumigraph/view_weights.h"
#include "scene/geometry/mesh.h"

namespace lumi {

using Words = std::map<std::string, std::string>;

struct ShownPicture {
  ImageF rgba;  // premultiplied
  double ms = 0;
  long samples = 0;  // rays at which weights were computed; 0: every pixel
};

class OpenedLumigraph {
 public:
  // mesh: in place of a proxy of the scene's, or nullptr. along_matrices: for the frames of a path of projection
  // matrices.
  OpenedLumigraph(const LumigraphOptions& options, const std::string& proxy, const Mesh* mesh, bool along_matrices,
                  ProgressSink& sink);

  const Lumigraph& lumigraph() const { return lumigraph_; }
  // For these views from now on; without it each picture has the measures that its own view calls for.
  void ChooseMeasures(const std::vector<RenderView>& views, const std::vector<std::string>& leave_out);
  ShownPicture Render(const RenderView& view, const std::vector<std::string>& leave_out, const std::string& show,
                      const std::string& backend, const Words& settings);
  ViewPlan Plan(const RenderView& view, const std::vector<std::string>& leave_out, const Words& settings);
  WeightsAtRays At(const RenderView& view, const std::vector<Eigen::Vector2d>& x_px,
                   const std::vector<std::string>& leave_out, const Words& settings);
  MeasureMap MapOf(const RenderView& view, const std::string& measure, const std::string& photo,
                   const std::vector<std::string>& leave_out, const Words& settings);
  std::string Device(const std::string& backend);
  // As --settings takes them: without a time where each picture has its own.
  JsonKeys Settings();
  std::vector<Effect> Effects();

 private:
  ViewWeights WeightsOf(const RenderView& view, const std::vector<std::string>& leave_out, const Words& settings);
  RadianceSettings SettingsFor(const RenderView& view, const std::vector<bool>& use, const Words& settings);
  // Photos that a picture of this view may be made of; empty: all.
  std::vector<bool> Use(const RenderView& view, const std::vector<std::string>& leave_out) const;
  std::vector<bool> Without(const std::vector<std::string>& leave_out) const;
  Renderer& RendererOf(const std::string& backend);

  std::mutex mutex_;
  Lumigraph lumigraph_;
  const bool along_matrices_;
  bool chosen_ = false;
  std::map<std::string, std::unique_ptr<Renderer>> renderers_;
  std::unique_ptr<TracedProxy> traced_;  // of the one mesh, made when first wanted
};

}  // namespace lumi
