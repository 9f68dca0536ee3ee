// A lumigraph: a scene opened for rendering, with its proxy (one mesh, or one a picture), photos, exposures, clock, and
// the measures that were chosen for it. Every program that makes pictures opens one; they differ in where the views
// come from.
//
//   Lumigraph lumigraph(options, sink);
//   lumigraph.MakePictures("", false);
//   lumigraph.ReadPhotos(sink);
//   lumigraph.ChooseMeasures(views, {});
//   const auto renderer = lumigraph.NewRenderer(MakeCpuRenderer);
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "render/effects/correlation_fit.h"
#include "render/effects/effects.h"
#include "render/effects/estimates.h"
#include "render/lumigraph/per_view_renderer.h"
#include "render/photos/photo_cache.h"
#include "render/photos/photo_set.h"
#include "render/radiance/settings.h"
#include "render/show/measure_map.h"
#include "render/world/per_view_proxy.h"
#include "render/world/renderer.h"
#include "scene/program/progress.h"

namespace lumi {

struct LumigraphOptions {
  std::filesystem::path scene;
  RadianceSettings settings;     // from --settings and the line
  std::string effects = "auto";  // auto, none, or a list of EffectNames()
  Decided decided;               // options and effects that the user spoke about
  std::optional<double> phase;   // of the scene's period, instead of a time
  std::optional<int>
      window_frames;  // photos to either side in time that a picture may use, -1: all; default: 5 for videos, else all
  double nominal_focal_px =
      0;                 // for pictures with their own proxy in a scene without a metric; 0: 1.2 x their longer side
  BorderOptions border;  // of pictures with a proxy of their own
  bool rescale_cameras = false;
  // Memory of the whole process, about. Photos that do not fit into it are read when pictures need them. 0: six tenths
  // of the free memory; -1: all photos are held.
  int memory_mb = -1;
  bool graphics = false;  // photos will be in graphics memory, which memory_mb counts, too
  // Pictures are as large as photos, and are compared with them: several of that size are in memory.
  bool compares_whole_photos = false;
};

class Lumigraph {
 public:
  // Opens the scene. Throws UsageError for unknown effects, and for options that need distances in a scene without a
  // metric; DataError for a scene without photos.
  Lumigraph(const LumigraphOptions& options, ProgressSink& sink);
  Lumigraph(const Lumigraph&) = delete;
  Lumigraph& operator=(const Lumigraph&) = delete;
  // Clock and proxy (a name, per-view, or empty: the active one); along_matrices: for the frames of a path of
  // projection matrices, or of a scene without a metric. Throws UsageError for options that do not go with the proxy,
  // InputError for a mesh that cannot be read, DataError (PerViewProxy).
  // own: this mesh in place of one of the scene's.
  void MakePictures(const std::string& proxy, bool along_matrices, const Mesh* own = nullptr);
  // one_mesh() only: from now on, this mesh replaces the proxy that MakePictures read, and keeps its name. Evaluations
  // use it for a proxy that was made without the held-out photos.
  void StandIn(Mesh mesh) { mesh_ = std::move(mesh); }
  // Reads the photos if every picture may use all of them, and makes the estimates from them that the user did not
  // switch off. halvings: of photos that are all held.
  void ReadPhotos(ProgressSink& sink, int halvings = 0);
  void SetEstimates(const PhotoEstimates& estimates);
  // Sets what LoadPhoto corrects photos for from now on. `estimates`: those that were set last.
  void Correct(const PhotoEstimates& estimates, const Corrections& corrections);
  // Switches on the measures in settings() that the views `desired`, rendered from the photos `use` (empty: all), call
  // for, except where the user decided.
  void ChooseMeasures(const std::vector<RenderView>& desired, const std::vector<bool>& use);
  // The measures that the data call for, whatever the user decided.
  EffectChoice MeasuresCalledFor(const std::vector<RenderView>& desired) const;
  // The same without views: only effects with Effect::from_photos have valid evidence.
  EffectChoice MeasuresCalledForByPhotos() const;

  const Scene& scene() const { return scene_; }
  bool metric() const { return scene_.frame == Frame::kMetric; }
  bool one_mesh() const { return !per_view_; }
  const Mesh& mesh() const { return mesh_; }  // of one_mesh()
  const std::string& proxy_name() const { return proxy_name_; }
  const Corrections& corrections() const { return corrections_; }  // that the photos were read with
  // one_mesh() only; else each picture reads its own photos. With a cache, only the photos that it holds have levels.
  const std::vector<Photo>& photos() const { return cache_ ? cache_->photos() : photos_; }
  // nullptr if the photos fit into options.memory_mb.
  const PhotoCache* cache() const { return cache_ ? &*cache_ : nullptr; }
  int reach() const { return reach_; }  // photos to either side in time that a picture may use; -1: all

  const RadianceSettings& settings() const { return settings_; }
  void SetSettings(const RadianceSettings& settings);
  // The result of settings().correlation kMeasured; none: not asked for.
  const std::optional<MeasuredCorrelation>& correlation() const { return correlation_; }
  const Decided& decided() const { return decided_; }
  const std::vector<Effect>& effects() const { return effects_; }
  std::vector<Effect>& effects() { return effects_; }
  bool own_times() const { return own_times_; }  // a picture shows its view's moment; else all show settings().time_s
  // Settings for this view: at its moment.
  RadianceSettings At(const RenderView& view, const RadianceSettings& settings) const;
  RadianceSettings At(const RenderView& view) const { return At(view, settings_); }

  // What a picture of this view is blended from.
  PictureWorld For(const RenderView& view) const;
  // Those of `use` (empty: all photos) that a picture of this view may be made of.
  std::vector<bool> InWindow(const RenderView& view, const std::vector<bool>& use) const;
  // A renderer of its photos over its proxy, or over `mesh`. The lumigraph must outlive the renderer.
  std::unique_ptr<Renderer> NewRenderer(WorldRendererMaker make) const;
  std::unique_ptr<Renderer> NewRenderer(WorldRendererMaker make, const Mesh& mesh) const;
  MeasureMap MapOf(const RenderRequest& request, Measure measure, int photo) const;

 private:
  std::optional<std::size_t> RoomForPhotos() const;
  std::size_t LargestPhoto() const;
  void TakeSmallCopies(ProgressSink& sink);
  void RequireNothingMetric(const std::string& proxy) const;
  void TakeCorrelation(const std::vector<bool>& use);
  void RequireExposure();
  std::unique_ptr<Renderer> WithOwnColors(std::unique_ptr<Renderer> renderer) const;

  const LumigraphOptions options_;
  RadianceSettings settings_;
  Decided decided_;                         // by the user, or by the kind of picture
  std::map<std::string, std::string> why_;  // reasons for decisions by the kind of picture
  Scene scene_;
  std::string proxy_name_;
  Mesh mesh_;
  std::optional<PerViewProxy> per_view_;  // instead of mesh_
  int reach_ = -1;
  bool own_times_ = true;
  std::vector<Photo> photos_;
  mutable std::optional<PhotoCache> cache_;  // instead of photos_; a picture that is rendered brings its photos
  std::size_t at_once_bytes_ = 0, graphics_bytes_ = 0;  // PhotoSupply's, with the cache
  int small_halvings_ = -1;                             // of the cache's small copies
  PhotoFacts photo_facts_;                              // what the photos' colours say
  Corrections corrections_;                             // that the photos were read with
  std::vector<Effect> effects_;
  std::optional<MeasuredCorrelation> correlation_;
};

// The view called so: by its photo's name, OutputName of it, or its position from 0, in this order. Throws UsageError.
int ViewCalled(const Scene& scene, const std::string& name);

}  // namespace lumi
