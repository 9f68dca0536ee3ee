#include "render/commands/render_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "render/commands/render_job.h"
#include "render/path/matrix_path.h"
#include "render/path/path_frames.h"
#include "render/picture/convert.h"
#include "render/show/camera_configuration.h"
#include "render/show/measure_map.h"
#include "render/show/proxy_picture.h"
#include "render/tradeoff/sweep.h"
#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/program/error.h"

namespace lumi {

std::unique_ptr<Renderer> RenderJob::NewRenderer() const {
  return lumigraph.NewRenderer(options.backend == "gl" ? MakeGlRenderer : MakeCpuRenderer);
}

RenderRequest RenderJob::Request(const RenderView& view) const {
  RenderRequest request;
  request.view = view;
  request.settings = lumigraph.At(view);
  request.show = options.show == "false-color"    ? Show::kFalseColor
                 : options.show == "tessellation" ? Show::kTessellation
                                                  : Show::kColor;
  return request;
}

ImageF RenderJob::Picture(const RenderRequest& request) {
  if (options.show == "proxy") {
    const PictureWorld world = lumigraph.For(request.view);
    return DrawProxy(world.sources, world.proxy, world.view);
  }
  if (const auto measure = MeasureFromName(options.show)) {
    MeasureMap map = lumigraph.MapOf(request, *measure, options.of.empty() ? -1 : ViewCalled(scene(), options.of));
    summary.scale = {options.show, map.low, map.high, map.unit};
    return std::move(map.image);
  }
  ImageF image = renderer->Render(request);
  const RenderStatistics statistics = renderer->Statistics();
  bring_ms += statistics.bring_ms;
  most_halved = std::max(most_halved, statistics.halved);
  most_photo_bytes = std::max(most_photo_bytes, statistics.photo_bytes);
  summary.samples += statistics.samples;
  summary.optimum += statistics.optimum;
  return image;
}

Image8 RenderJob::CamerasAround(const RenderView& view) const {
  return DrawCameraConfiguration(scene(), lumigraph.For(view).proxy, view, kConfigurationSide);
}

void RenderJob::Write(const std::filesystem::path& stem, const ImageF& image) const {
  const std::filesystem::path file = stem.string() + "." + options.format;
  if (options.format == "exr")
    WriteImage(file, image);
  else
    WriteImage(file, options.format == "jpg" ? ToRgb8(image) : Fills() ? ShownToRgba8(image) : ToRgba8(image));
}

Eigen::Vector2i SizeAskedFor(const RenderOptions& o, const Eigen::Vector2i& own) {
  return SizeFor(o.width_px, o.height_px, own);
}

namespace {

// The matrices of --path or, without --path, of the photos if the scene has no poses.
std::optional<MatrixPath> MatricesOf(const RenderOptions& o, const Lumigraph& lumigraph) {
  if (!o.along_path()) return std::nullopt;
  if (!lumigraph.metric() && o.path.empty() && o.decided.Has("seconds"))
    throw UsageError("--seconds is of a path between poses, which this scene does not have: a frame a photo");
  std::optional<MatrixPath> matrices = MatrixPathFor(lumigraph.scene(), o.path, o.fps);
  if (!matrices && !o.path.empty() && o.decided.Has("fps"))
    throw UsageError("--fps with --path is of a path of matrices (lumi-stabilize): a path of poses has its own rate");
  return matrices;
}

DesiredViews WantedBy(const RenderJob& job) {
  if (job.options.holdout != 0) return HeldOutWanted(job);
  return job.options.view.empty() ? FramesWanted(job) : ViewWanted(job);
}

// Takes settings that were measured; where they switch an effect, its evidence says so.
void Take(Lumigraph& lumigraph, const RadianceSettings& settings, const char* chosen_with) {
  lumigraph.SetSettings(settings);
  for (Effect& e : lumigraph.effects())
    if (const bool on = lumigraph.settings().resolution != Resolution::kOff; e.name == "resolution" && e.on != on) {
      e.on = on;
      e.decided_by.clear();
      e.evidence = chosen_with;
    }
}

// --budget-ms: the settings for frames like the first one. What the user decided stays.
void KeepBudget(RenderJob& job) {
  if (!job.options.budget_ms) return;
  Lumigraph& lumigraph = job.lumigraph;
  RenderRequest request;
  request.view = job.wanted.views.front();
  request.settings = lumigraph.At(request.view);
  request.use = job.wanted.use;
  job.summary.budget.emplace().choice =
      ChooseForBudget(job.scene().folder, job.options.backend, lumigraph.proxy_name(), *job.renderer, request,
                      Fixed(lumigraph.settings(), lumigraph.decided()), *job.options.budget_ms);
  Take(lumigraph, job.summary.budget->choice.settings, "chosen with the budget");
}

// --fidelity-db: chooses sparse samples that come near enough to weights at every pixel, judged on a few frames of the
// path.
void KeepFidelity(RenderJob& job) {
  if (!job.options.fidelity_db) return;
  Lumigraph& lumigraph = job.lumigraph;
  std::vector<RenderRequest> requests;
  for (const std::size_t i : FidelityFrames(job.wanted.views.size())) {
    requests.push_back(job.Request(job.wanted.views[i]));
    requests.back().use = lumigraph.InWindow(requests.back().view, {});
  }
  job.summary.fidelity =
      ChooseFaithful(job.scene().folder, job.options.backend, lumigraph.proxy_name(), *job.renderer, requests,
                     lumigraph.settings(), Fixed(lumigraph.settings(), lumigraph.decided()), *job.options.fidelity_db);
  Take(lumigraph, job.summary.fidelity->settings, "chosen with the sparse samples");
}

void MeasureCosts(RenderJob& job) {
  // Without an effect other photos are wanted: reading them is not what it costs.
  if (job.lumigraph.cache() != nullptr) return;
  const RenderView& first = job.wanted.views.front();
  EffectChoice choice{job.lumigraph.At(first), job.lumigraph.effects()};
  MeasureEffects(*job.renderer, first, job.wanted.use, choice);
  job.lumigraph.effects() = std::move(choice.effects);
}

void Prepare(RenderJob& job) {
  const RenderOptions& o = job.options;
  Lumigraph& lumigraph = job.lumigraph;
  if (!o.view.empty()) ViewCalled(job.scene(), o.view);
  job.matrices = MatricesOf(o, lumigraph);
  if (!lumigraph.metric() && o.show == "cameras")
    throw UsageError(
        fmt::format("--show cameras draws distances, which a {} scene does not have", Name(job.scene().frame)));
  lumigraph.MakePictures(o.proxy, job.matrices.has_value());
  // If each picture has its own proxy, --border fill also reads photos farther away in time, which any --show can use.
  if (o.border.fill && lumigraph.one_mesh() && !job.Fills())
    throw UsageError(
        fmt::format("--border fill gives the holes of a picture colours: --show {} does not go with it", o.show));
  if (o.holdout != 0) TakeEvaluationProxy(job);
  lumigraph.ReadPhotos(job.sink);
  if (job.options.part_of_path() && job.options.backend == "gl" && lumigraph.cache() != nullptr)
    throw MachineError("the photos do not fit into memory here, and OpenGL's pictures depend on which ones do",
                       "use --backend cpu, or give more --memory-mb");
  job.wanted = WantedBy(job);
  lumigraph.ChooseMeasures(job.wanted.views, job.wanted.use);
  if ((job.summary.correlation = lumigraph.correlation()))
    job.sink.Message(
        fmt::format("photos correlate over this proxy as leaves of {:.3g} to {:.3g} degrees do; noise {:.3g}",
                    job.summary.correlation->r_min_rad / kRadPerDeg, job.summary.correlation->r_max_rad / kRadPerDeg,
                    job.summary.correlation->noise));
  job.renderer = job.NewRenderer();
  KeepBudget(job);
  KeepFidelity(job);
  if (o.show == "tessellation" && !HasSamples(lumigraph.settings()))
    job.sink.Message("the budget is kept without sparse samples: --show tessellation has none to show");
  MeasureCosts(job);
}

// Judges the budget by the frames' measured times.
void JudgeBudget(RenderJob& job) {
  if (!job.summary.budget) return;
  KeptBudget& kept = *job.summary.budget;
  kept.ms = job.summary.ms_per_frame;
  const double ms = kept.ms.value_or(kept.choice.ms), budget_ms = kept.choice.budget_ms;
  kept.met = kept.ms ? ms <= budget_ms : kept.choice.fits;
  if (kept.met) return;
  // The time grows at most in proportion to the pixels.
  const int width = job.wanted.views.front().size_px.x();
  constexpr double kToSpare = 0.9;
  constexpr int kNarrowest = 16;
  const int narrower = static_cast<int>(width * std::sqrt(kToSpare * budget_ms / ms));
  if (narrower >= kNarrowest) kept.meets_it = fmt::format("--width {}, or ", narrower);
  kept.meets_it += fmt::format("--budget-ms {:.0f}", std::ceil(ms / kToSpare));
}

void Summarise(RenderJob& job) {
  const Lumigraph& lumigraph = job.lumigraph;
  RenderSummary& s = job.summary;
  s.proxy = lumigraph.proxy_name();
  if (!lumigraph.metric()) s.frame = Name(job.scene().frame);
  s.window_frames = lumigraph.reach();
  s.device = job.renderer->Device();
  s.settings = lumigraph.settings();
  s.own_times = lumigraph.own_times();
  s.backend = job.options.backend;
  s.effects = lumigraph.effects();
  if (const PhotoCache* cache = lumigraph.cache()) {
    const PhotoCache::Counts& c = cache->counts();
    const int halved = job.most_halved;
    s.photos_in_memory = {c.read, halved, static_cast<double>(std::max(c.most, job.most_photo_bytes)) / (1 << 20),
                          job.bring_ms / 1000};
    if (halved > 0)
      job.sink.Message(
          fmt::format("a picture's photos did not fit into memory together: they were halved {} time{}; "
                      "more --memory-mb keeps them sharp",
                      halved, halved == 1 ? "" : "s"));
  }
  JudgeBudget(job);
  if (2 * s.optimum.small_sums > s.optimum.samples)
    job.sink.Message(
        fmt::format("at {:.0f} % of the samples no photo correlates with the ray: they stand farther apart than 2 x "
                    "--r-max-deg, and the "
                    "optimum falls back to the local mean; a larger --r-max-deg gives it something to say",
                    100.0 * static_cast<double>(s.optimum.small_sums) / static_cast<double>(s.optimum.samples)));
}

}  // namespace

void MarkOutput(const RenderJob& job) {
  const std::filesystem::path& folder = job.options.output;
  if (std::error_code error;
      !folder.empty() && !job.options.to_video() && !std::filesystem::exists(folder / kRenderMarker, error))
    WriteTextAtomically(folder / kRenderMarker, "{}\n");
}

RenderSummary RunRender(const RenderOptions& given, ProgressSink& sink) {
  RequireConsistent(given);
  RenderOptions o = given;
  o.graphics = o.backend == "gl";
  o.compares_whole_photos = o.holdout != 0 && o.width_px == 0;
  const bool to_folder = !o.output.empty() && !o.to_video();
  if (to_folder) {
    std::error_code ec;
    if (std::filesystem::exists(o.output / "lumigraph.json", ec))
      throw UsageError(fmt::format("{} is a scene: pictures are not written into it", o.output.string()),
                       fmt::format("give them a folder of their own: -o {}", (o.output / "renders").string()));
    RequireOurFolder(o.output, kRenderMarker, o.part_of_path());
  }
  if (o.to_video()) RemoveStaleTemporariesOf(o.output);
  RenderJob job{o, sink, Lumigraph(o, sink), {}, {}, {}, {}};
  o.holdout = HoldoutFor(o.holdout, job.scene().views.size());
  Prepare(job);
  if (o.holdout != 0) {
    RenderHeldOut(job);
  } else {
    MarkOutput(job);
    if (!o.view.empty())
      RenderOneView(job);
    else
      RenderPath(job);
  }
  Summarise(job);
  if (to_folder) WriteTextAtomically(o.output / kRenderMarker, JsonKeys(job.summary).Text(2) + "\n");
  return std::move(job.summary);
}

}  // namespace lumi
