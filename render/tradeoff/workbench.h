// What the measuring commands share: the scene opened once, its photos, and a renderer a proxy.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "render/lumigraph/lumigraph.h"
#include "render/settings_json.h"
#include "render/tradeoff/measure.h"
#include "scene/program/progress.h"

namespace lumi {

struct MeasureOptions : LumigraphOptions {  // settings: the base point of the sweep
  std::filesystem::path output;
  std::vector<std::string> proxies;  // empty: all the scene has, the active one first
  std::string backend = "cpu";       // cpu, gl
  int width_px = 0;                  // 0: the photos', at most 1024
  int reference_width_px = 0;  // of pictures compared with the optimum; 0: what takes about half a minute, at most 480
  int holdout = 8;
  int views = 3;  // of a fold that are measured
  int repeats = 3;
  bool quick = false;          // fewer points, at most 320 pixels wide
  std::string view;            // --ablation: this photo's own camera, without the photo
  std::filesystem::path path;  // the first frame of this camera path: for --ablation instead, for the sweep's Fig. 5-4
  std::filesystem::path against;  // --time-windows: a scene whose photos, at their cameras and times, are the truth
};

// Throws UsageError, one line.
void RequireConsistent(const MeasureOptions& options);

class Workbench {
 public:
  // Opens the scene, reads its photos. `marker`: the file that makes an output folder ours.
  Workbench(const MeasureOptions& options, const std::string& marker, ProgressSink& sink);

  const Lumigraph& lumigraph() const { return lumigraph_; }  // over the first of the proxies
  const Scene& scene() const { return lumigraph_.scene(); }
  // The options' settings, with the effects that the scene calls for at its held-out photos.
  const RadianceSettings& settings() const { return lumigraph_.settings(); }
  // `settings` for this view: at its own time, unless the options name one.
  RadianceSettings For(const RenderView& view, const RadianceSettings& settings) const {
    return lumigraph_.At(view, settings);
  }
  RenderRequest Request(const TestView& t, const RadianceSettings& settings) const {
    return {.view = t.view, .settings = For(t.view, settings), .use = t.use};
  }
  // As --settings takes them back.
  JsonKeys Keys(const RadianceSettings& settings) const { return KeysOf(settings, lumigraph_.own_times(), o_.backend); }
  const std::vector<std::string>& proxies() const { return proxies_; }
  // The proxy's mesh or, if the scene has one, that of the proxy made without the held-out photos.
  const Mesh& mesh(const std::string& proxy) const;
  // Proxies that were replaced for the evaluation, with their replacements, by name; empty with --view.
  const std::map<std::string, std::string>& proxies_evaluated() const { return evaluated_; }
  // Renderers are made when first needed. References always come from the CPU's.
  Renderer& Cpu(const std::string& proxy);
  Renderer& Measured(const std::string& proxy);
  // Destroys a proxy's renderers: on a GPU, each holds all photos.
  void Drop(const std::string& proxy);
  // Width that frames are measured at.
  int Width() const;
  // Whether SCENE/fronts may be written: a scene folder of ours, no other tool's workspace.
  bool MayWriteScene() const;

 private:
  // The name of the proxy that is rendered over in place of `proxy`.
  std::string Evaluated(const std::string& proxy, ProgressSink& sink);

  const MeasureOptions& o_;
  Lumigraph lumigraph_;
  std::vector<std::string> proxies_;
  std::map<std::string, std::string> evaluated_;
  std::map<std::string, Mesh> meshes_;  // all but the first proxy's
  std::map<std::string, std::unique_ptr<Renderer>> cpu_, gl_;
};

// The optimum that everything is measured against: every pixel, all cameras within 24 degrees (thesis chapter 4; beyond
// them a weight changes by less than 1e-6).
RadianceSettings ReferenceSettings(const RadianceSettings& base);

}  // namespace lumi
