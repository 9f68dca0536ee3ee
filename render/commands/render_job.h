// One run of lumi-render: the lumigraph it opened, its renderer, and what it did so far. render_command.cc prepares it;
// path_command.cc, view_command.cc and holdout_command.cc each do one of the three things that it may be asked for.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "render/commands/render_options.h"
#include "render/commands/render_summary.h"
#include "scene/files/matrix_path.h"
#include "scene/program/progress.h"

namespace lumi {

constexpr const char* kRenderMarker = "render.json";  // marks an output folder as ours
constexpr int kConfigurationSide = 640;               // px; of each panel of --show cameras

struct RenderJob {
  const RenderOptions& options;
  ProgressSink& sink;
  Lumigraph lumigraph;
  std::optional<MatrixPath> matrices;  // of a path of projection matrices
  DesiredViews wanted;
  std::unique_ptr<Renderer> renderer;
  RenderSummary summary;
  double bring_ms = 0;               // reading photos for all pictures
  int most_halved = 0;               // of the pictures' photos
  std::size_t most_photo_bytes = 0;  // that photos took in graphics memory, where not all are

  const Scene& scene() const { return lumigraph.scene(); }
  // A renderer for the lumigraph as it is now, with the backend of the options.
  std::unique_ptr<Renderer> NewRenderer() const;
  // A picture of this view, as the options want it.
  RenderRequest Request(const RenderView& view) const;
  // The renderer's picture, the proxy, or a measure. Counts samples.
  ImageF Picture(const RenderRequest& request);
  bool Fills() const { return options.border.fill && options.show == "color"; }  // FillAndMark before Write
  Image8 CamerasAround(const RenderView& view) const;                            // --show cameras
  void Write(const std::filesystem::path& stem, const ImageF& image) const;
};

// Called before the first file is written: if this run is killed, the next one knows the folder as ours.
void MarkOutput(const RenderJob& job);

// The size asked for; a side that was not given follows from `own`'s aspect.
Eigen::Vector2i SizeAskedFor(const RenderOptions& options, const Eigen::Vector2i& own);

// The frames of a path, at the size that is wanted.
DesiredViews FramesWanted(const RenderJob& job);
void RenderPath(RenderJob& job);

// The camera of --view.
DesiredViews ViewWanted(const RenderJob& job);
void RenderOneView(RenderJob& job);

// If the scene has a proxy that was made without the held-out photos, the lumigraph uses it from now on, and a message
// says so.
void TakeEvaluationProxy(RenderJob& job);
DesiredViews HeldOutWanted(const RenderJob& job);
void RenderHeldOut(RenderJob& job);

}  // namespace lumi
