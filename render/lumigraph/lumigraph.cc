#include "render/lumigraph/lumigraph.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "render/lumigraph/own_colors_renderer.h"
#include "render/photos/photo_correction.h"
#include "render/photos/small_photos.h"
#include "render/picture/output_name.h"
#include "render/radiance/setting_options.h"
#include "render/time/clock.h"
#include "render/time/photo_window.h"
#include "scene/files/image_io.h"
#include "scene/files/scene_folder.h"
#include "scene/program/error.h"
#include "scene/program/memory.h"
#include "scene/program/parallel.h"

namespace lumi {

Lumigraph::Lumigraph(const LumigraphOptions& options, ProgressSink& sink)
    : options_(options), settings_(options.settings), decided_(options.decided) {
  ApplyEffectList(options_.effects, settings_, decided_);
  RequireExposure();
  OpenOptions open;
  open.rescale_cameras = options_.rescale_cameras;
  scene_ = OpenScene(options_.scene, open, sink);
  if (scene_.views.empty()) throw DataError("the scene has no photos with cameras", "", options_.scene);
}

// White balance and vignetting are parts of exposure, whose gain gives back the brightness that their corrections take:
// where it is off, so are they.
void Lumigraph::RequireExposure() {
  if (!decided_.Has("exposure") || settings_.exposure) return;
  for (const char* name : {"white-balance", "vignetting"}) {
    if (decided_.Has(name) && IsOn(settings_, name))
      throw UsageError(fmt::format("{} is a part of exposure, which is off", name), "switch exposure on, too");
    decided_.Add(name);
    why_[name] = "exposure is off";
  }
}

// Throws for options that need metric distances or angles.
void Lumigraph::RequireNothingMetric(const std::string& proxy) const {
  const std::string frame(Name(scene_.frame));
  if (!proxy.empty() && proxy != kPerViewProxy)
    throw UsageError(fmt::format("a {} scene is rendered with each view's own proxy: --proxy per-view", frame));
  if (options_.decided.Has("resolution") && options_.settings.resolution == Resolution::kDistance)
    throw UsageError(fmt::format("--resolution distance compares distances, which a {} scene does not have", frame),
                     "use --resolution jacobian");
}

void Lumigraph::MakePictures(const std::string& proxy, bool along_matrices, const Mesh* own) {
  if (!metric()) RequireNothingMetric(proxy);
  const Decided asked = decided_;
  const auto decide = [&](const char* why) {
    for (const std::string& name : decided_.options())
      if (!asked.Has(name)) why_.emplace(name, why);
  };
  if (along_matrices || !metric())
    reach_ = TakeWindow(scene_, options_.window_frames, along_matrices, decided_, settings_);
  decide("so for pictures of a window in time");
  if (proxy == kPerViewProxy || !metric()) {
    proxy_name_ = kPerViewProxy;
    PerViewOptions each;
    each.nominal_focal_px = options_.nominal_focal_px;
    per_view_.emplace(scene_, each);
    // Which photos see a surface that was made for another view is unknown.
    if (decided_.Has("visibility") && settings_.visibility)
      throw UsageError("--proxy per-view hides nothing: --visibility does not go with it");
    settings_.visibility = false;
    decided_.Add("visibility");
    decide("so for a proxy of each view");
  } else {
    if (decided_.Has("fill-frames") || options_.nominal_focal_px > 0)
      throw UsageError("--fill-frames and --nominal-focal-px are of pictures that have a proxy of their own",
                       "add --proxy per-view");
    mesh_ = own != nullptr ? *own : LoadProxy(scene_, proxy);
    proxy_name_ = own != nullptr ? "own mesh" : proxy.empty() ? scene_.active_proxy : proxy;
  }
  TakeClock(scene_, decided_.Has("time-window-s"), settings_);
  own_times_ = !options_.phase && !decided_.Has("time-s");
  if (own_times_) settings_.time_s = FirstTime(scene_).value_or(settings_.time_s);
  if (!options_.phase) return;
  if (!(settings_.period_s > 0))
    throw DataError("the scene has no period, so that --phase says nothing", "use --time-s", options_.scene);
  settings_.time_s = *options_.phase * settings_.period_s;
}

// Bytes that options.memory_mb leaves for photos, if not all of them fit; nullopt: all may be held.
std::optional<std::size_t> Lumigraph::RoomForPhotos() const {
  if (options_.memory_mb < 0 || !one_mesh()) return std::nullopt;
  // Measuring the correlation reads all photos: only an explicit limit that they exceed is an error.
  if (options_.memory_mb == 0 && settings_.correlation == Correlation::kMeasured) return std::nullopt;
  constexpr double kShare = 0.6;  // of the free memory, if no limit is given
  constexpr std::size_t kMb = 1 << 20;
  constexpr std::size_t kLeast = 4 * kMb;
  // Visibility maps and pictures, which come later; a graphics processor has both, too.
  std::size_t others = (options_.graphics ? 640 : 320) * kMb;
  // 80 bytes a pixel (two pictures, the photo, 8-bit copies, and SSIM's floats), where the photo's pyramid has 4.
  if (options_.compares_whole_photos) others = std::max(others, others / 2 + 80 / 4 * LargestPhoto());
  const std::size_t all = options_.memory_mb > 0
                              ? static_cast<std::size_t>(options_.memory_mb) * kMb
                              : static_cast<std::size_t>(kShare * static_cast<double>(AvailableMemory()));
  const std::size_t taken = others + (options_.memory_mb > 0 ? ResidentMemory() : 0);
  const std::size_t room = std::max(kLeast, all > taken ? all - taken : 0);
  // Photos that are all held are held twice for a graphics processor, there with four bytes a pixel.
  const std::size_t bytes = PhotoCache::BytesOf(scene_);
  return bytes + (options_.graphics ? bytes / 3 * 4 : 0) > room ? std::optional(room) : std::nullopt;
}

std::size_t Lumigraph::LargestPhoto() const {
  std::size_t bytes = 0;
  for (const Camera& c : scene_.cameras)
    bytes = std::max(bytes, PhotoCache::BytesOf(Eigen::Vector2i(c.width_px, c.height_px)));
  return bytes;
}

void Lumigraph::ReadPhotos(ProgressSink& sink, int halvings) {
  if (const std::optional<std::size_t> room = RoomForPhotos()) {
    // Photos on their way to a graphics processor stay in memory only until they are there.
    constexpr std::size_t kMostAtOnce = std::size_t{192} << 20;
    at_once_bytes_ = options_.graphics ? std::max(LargestPhoto(), std::min(kMostAtOnce, *room / 4)) : *room;
    graphics_bytes_ = options_.graphics ? *room - std::min(*room, at_once_bytes_) : *room;
    cache_.emplace(scene_, at_once_bytes_);
    sink.Message(fmt::format("{} photos take {:.1f} GB of memory: {:.1f} GB hold those that a picture is blended from",
                             scene_.views.size(), static_cast<double>(PhotoCache::BytesOf(scene_)) / 1e9,
                             static_cast<double>(*room) / 1e9));
  } else if (one_mesh()) {
    photos_ = LoadPhotos(scene_, {.halvings = halvings}, sink);
  }
  const auto wanted = [&](std::string_view effect) { return !decided_.Has(effect) || IsOn(settings_, effect); };
  SetEstimates(EstimateFromPhotos(scene_, one_mesh() && !cache_ ? &photos_ : nullptr, wanted, sink));
  // Corrects the photos as LoadPhoto would from now on.
  if (corrections_.Any())
    ParallelFor(photos_.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        Image8 pixels = std::move(photos_[i].levels.front());
        lumi::Correct(*scene_.views[i].correction, pixels);
        photos_[i].levels = BuildPyramid(std::move(pixels));
      }
    });
  if (cache_) TakeSmallCopies(sink);
}

// After corrections are known: the copies are corrected.
void Lumigraph::TakeSmallCopies(ProgressSink& sink) {
  if (!CallsForSmallPhotos(scene_)) return;
  small_halvings_ = CopyHalvings(scene_);
  std::vector<Photo> small = ReadSmallPhotos(scene_, small_halvings_, sink);
  // Those for a graphics processor are there, too.
  const std::size_t bytes = options_.graphics ? PhotoCache::BytesOf(small) : 0;
  graphics_bytes_ -= std::min(graphics_bytes_, bytes);
  cache_.emplace(scene_, at_once_bytes_ + bytes);
  cache_->SetSmall(std::move(small));
}

void Lumigraph::SetEstimates(const PhotoEstimates& estimates) {
  photo_facts_ = estimates.Facts();
  const auto wanted = [&](std::string_view effect, bool seen) {
    return decided_.Has(effect) ? IsOn(settings_, effect) : seen;
  };
  Correct(estimates, {estimates.exposures && wanted("white-balance", photo_facts_.color_spread > 1),
                      estimates.exposures && wanted("vignetting", photo_facts_.corner < 1)});
}

void Lumigraph::Correct(const PhotoEstimates& estimates, const Corrections& corrections) {
  corrections_ = corrections;
  photo_facts_.corrected = corrections.Any();
  Apply(estimates, corrections, scene_);
}

void Lumigraph::SetSettings(const RadianceSettings& settings) {
  settings_ = settings;
  // The photos were already read with these corrections.
  settings_.white_balance = corrections_.white_balance;
  settings_.vignetting = corrections_.vignetting;
  if (corrections_.Any()) settings_.exposure = true;
}

void Lumigraph::TakeCorrelation(const std::vector<bool>& use) {
  if (settings_.correlation_regions > 1 &&
      (settings_.correlation != Correlation::kMeasured || settings_.similarity != Similarity::kFull) && !correlation_)
    throw UsageError("--correlation-regions goes with --correlation measured and --similarity full");
  if (settings_.correlation != Correlation::kMeasured) return;
  // A settings file names all of them, so default values are accepted.
  const RadianceSettings usual;
  if (settings_.r_min_rad != usual.r_min_rad || settings_.r_max_rad != usual.r_max_rad ||
      settings_.noise != usual.noise)
    throw UsageError("--correlation measured finds --r-min-deg, --r-max-deg and --noise: give either");
  if (photos_.empty())
    throw UsageError(
        cache_ ? "--correlation measured reads all photos, and they do not fit into memory"
               : "--correlation measured reads all photos, over one mesh",
        cache_ ? "give more --memory-mb"
               : "lumi-render SCENE --correlation measured prints r-min-deg and r-max-deg, which go with --correlation "
                 "falling-leaves");
  correlation_ = MeasureCorrelation(scene_, mesh_, photos_, use, settings_.correlation_regions);
  if (!correlation_)
    throw DataError("too few photos see the same points to measure how they correlate",
                    "use --correlation falling-leaves", scene_.folder);
  settings_.correlation = Correlation::kFallingLeaves;
  settings_.r_min_rad = correlation_->r_min_rad;
  settings_.r_max_rad = correlation_->r_max_rad;
  settings_.noise = correlation_->noise;
  settings_.by_place = correlation_->by_place;
}

void Lumigraph::ChooseMeasures(const std::vector<RenderView>& desired, const std::vector<bool>& use) {
  TakeCorrelation(use);
  const auto world = [&](const RenderView& view) {
    PictureWorld w = For(view);
    for (std::size_t i = 0; i < w.photos.size(); ++i)
      w.use[i] = w.use[i] && (use.empty() || use[static_cast<std::size_t>(w.photos[i])]);
    return w;
  };
  EffectChoice choice = one_mesh() ? ChooseEffects(scene_, mesh_, desired, use, settings_, decided_, photo_facts_)
                                   : ChooseEffects(scene_, desired, world, settings_, decided_, photo_facts_);
  settings_ = choice.settings;
  if (!metric() && settings_.resolution == Resolution::kDistance) settings_.resolution = Resolution::kJacobian;
  effects_ = std::move(choice.effects);
  for (Effect& e : effects_)
    if (const auto why = why_.find(e.name); why != why_.end()) e.decided_by = why->second;
}

EffectChoice Lumigraph::MeasuresCalledFor(const std::vector<RenderView>& desired) const {
  return ChooseEffects(scene_, mesh_, desired, {}, settings_, {}, photo_facts_);
}

EffectChoice Lumigraph::MeasuresCalledForByPhotos() const {
  return ChooseEffects(scene_, {}, {}, settings_, {}, photo_facts_);
}

RadianceSettings Lumigraph::At(const RenderView& view, const RadianceSettings& settings) const {
  RadianceSettings s = own_times_ ? AtTimeOf(settings, view) : settings;
  s.exposure |= corrections_.Any();  // it gives back the brightness that they take
  return s;
}

PictureWorld Lumigraph::For(const RenderView& view) const {
  if (per_view_) return per_view_->For(view, reach_);
  PictureWorld world = *WorldOf(scene_, mesh_);
  world.view = view;
  return world;
}

std::vector<bool> Lumigraph::InWindow(const RenderView& view, const std::vector<bool>& use) const {
  if (per_view_ || reach_ < 0) return use;
  const PhotoOrder order(scene_);
  const auto [first, last] = order.Around(view.time_s, reach_);
  std::vector<bool> within(scene_.views.size(), false);
  for (int rank = first; rank <= last; ++rank) {
    const auto v = static_cast<std::size_t>(order.view(rank));
    within[v] = use.empty() || use[v];
  }
  return within;
}

std::unique_ptr<Renderer> Lumigraph::NewRenderer(WorldRendererMaker make) const {
  if (!per_view_) return NewRenderer(make, mesh_);
  return WithOwnColors(MakePerViewRenderer(scene_, *per_view_, make, reach_, options_.border));
}

std::unique_ptr<Renderer> Lumigraph::NewRenderer(WorldRendererMaker make, const Mesh& mesh) const {
  PhotoSupply supply;
  if (cache_)
    supply = {[this](std::span<const WantedPhoto> wanted) { return cache_->Bring(wanted); }, CopyHalvings(scene_),
              at_once_bytes_, graphics_bytes_, small_halvings_};
  return WithOwnColors(make(WorldOf(scene_, mesh), photos(), std::move(supply)));
}

std::unique_ptr<Renderer> Lumigraph::WithOwnColors(std::unique_ptr<Renderer> renderer) const {
  return corrections_.Any() ? MakeOwnColorsRenderer(std::move(renderer)) : std::move(renderer);
}

MeasureMap Lumigraph::MapOf(const RenderRequest& request, Measure measure, int photo) const {
  return per_view_ ? RenderMeasureMap(For(request.view), request, measure, photo)
                   : RenderMeasureMap(scene_, mesh_, request, measure, photo);
}

int ViewCalled(const Scene& scene, const std::string& name) {
  const auto first = [&](const auto& fits) {
    return static_cast<std::size_t>(std::ranges::find_if(scene.views, fits) - scene.views.begin());
  };
  std::size_t found = first([&](const View& v) { return v.name == name; });
  if (found == scene.views.size()) found = first([&](const View& v) { return OutputName(v.name) == name; });
  if (found == scene.views.size() && !name.empty() && name.size() < 8 &&
      name.find_first_not_of("0123456789") == std::string::npos)
    found = std::stoul(name);
  if (found < scene.views.size()) return static_cast<int>(found);
  throw UsageError(fmt::format("the scene has no photo '{}'", name),
                   fmt::format("photos are named as '{}', or by position 0 to {}", scene.views.front().name,
                               scene.views.size() - 1));
}

}  // namespace lumi
