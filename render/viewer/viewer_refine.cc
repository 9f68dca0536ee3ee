// The picture at rest: when the picture by optimal weights at every pixel is complete, it replaces that of the graphics
// processor, until anything else is to be shown.
#include <algorithm>
#include <numeric>

#include "render/settings_json.h"
#include "render/viewer/viewer_app.h"

namespace lumi {
namespace {

constexpr double kRest_s = 0.15;  // without a change, before it begins
constexpr int kStandInGrid = 25;  // samples a side: stands in for the optimum at every pixel until that is drawn

// A published method at every pixel, else the optimum.
RadianceSettings SettingsAtRest(const RadianceSettings& settings) {
  if (settings.method == Algorithm::kUlr) return OptimalSettings(settings);
  RadianceSettings s = settings;
  s.similarity = Similarity::kIdentity;
  s.grid_columns = s.grid_rows = 0;
  return s;
}

}  // namespace

// The settings that the graphics processor draws for those in the panel. The optimum at every pixel is replaced by
// sparse samples, and a published method by this renderer's own weights; both are drawn at rest.
RadianceSettings Viewer::Drawn() const {
  RadianceSettings s = settings_.radiance;
  s.method = Algorithm::kUlr;  // a published method's picture comes at rest, too
  if (!settings_.Refines() || s.similarity != Similarity::kFull || s.Sparse() || !Validate(s).empty()) return s;
  s.grid_columns = s.grid_rows = kStandInGrid;
  s.sampling = Sampling::kInterpolated;
  return s;
}

// The request for the picture at rest; nullopt: the graphics processor's picture stays.
std::optional<RenderRequest> Viewer::WantedRefinement() const {
  const bool samples_shown = settings_.seen.show == Show::kTessellation && settings_.radiance.Sparse();
  const bool other = settings_.seen.flat || settings_.seen.measure;
  const bool plays = playing_s_ || (settings_.play_time && settings_.radiance.time);
  if (!settings_.Refines() || samples_shown || other || plays) return std::nullopt;
  const RadianceSettings optimal = SettingsAtRest(settings_.radiance);
  if (!Validate(optimal).empty()) return std::nullopt;
  return Request(size_px_, optimal);
}

bool Viewer::RefinementOpen() const {
  return rest_.wanted && !rest_.ended && !jobs_.path_recording && !jobs_.probe.busy();
}

void Viewer::StopRefining() {
  if (!rest_.refiner.busy()) return;
  rest_.refiner.Cancel();
  ++rest_.cancelled;
}

// After Paint. `moving`: the camera will have moved by the next picture.
void Viewer::StepRefinement(bool changed, bool moving) {
  const std::optional<RenderRequest> wanted = WantedRefinement();
  const bool same = wanted.has_value() == rest_.wanted.has_value() && (!wanted || Same(*wanted, *rest_.wanted)) &&
                    rest_.generation == generation_;
  if (!same) {
    StopRefining();
    rest_.picture.Clear();
    rest_.ended = false;
    rest_.wanted = wanted;
    rest_.generation = generation_;
  }
  if (changed || moving || !same) rest_.since = Clock::now();
  if (jobs_.path_recording || jobs_.probe.busy()) StopRefining();  // measuring and recording get all cores
  if (auto picture = rest_.refiner.Take()) {
    rest_.ended = true;
    rest_.seconds = picture->seconds;
    rest_.problem = picture->problem;
    if (picture->problem.empty()) {
      rest_.picture.Set(picture->image);
      ++rest_.pictures;
    } else {
      Say(picture->problem);
    }
  }
  if (wanted && RefinementOpen() && !rest_.refiner.busy() && KeepPhotos(*wanted) && painter_.complete() &&
      moving_.budget.ToProbe() == nullptr && SecondsSince(rest_.since) >= kRest_s)
    rest_.refiner.Start({*wanted, gl_.sources(), proxy_tracer_, gl_.visibility(), rest_.photos});
  facts_.refined = !rest_.picture.empty();
  facts_.refining = rest_.refiner.busy();
  facts_.refined_fraction = rest_.refiner.fraction();
  facts_.refinement_s = rest_.seconds;
}

// Of all photos: those that a picture of this view is blended from, as large as they are seen, and halved from the
// least important one on until they fit beside graphics memory.
void Viewer::KeepPhotosOf(const RenderRequest& wanted) {
  std::vector<std::size_t> ranked;
  rest_.halvings.assign(scene_.views.size(), 0);
  for (const WantedPhoto& w : gl_.PhotosWanted(wanted)) {
    ranked.push_back(static_cast<std::size_t>(w.photo));
    rest_.halvings[ranked.back()] = std::min(w.halvings, CopyHalvings(scene_));
  }
  HalveToFit(
      ranked, rest_.photo_bytes,
      [&](std::size_t v, int halvings) {
        const Camera& camera = scene_.CameraOf(scene_.views[v]);
        return PhotoCache::BytesOf(HalvedSize({camera.width_px, camera.height_px}, halvings));
      },
      rest_.halvings);
  auto photos = std::make_shared<std::vector<Photo>>(scene_.views.size());
  std::vector<std::int32_t> ask;
  for (const std::size_t v : ranked) {
    const Photo& have = (*rest_.photos)[v];
    if (have.levels.empty() || have.level0_shift > rest_.halvings[v])
      ask.push_back(static_cast<std::int32_t>(v));
    else
      (*photos)[v] = HalvedTo(have, rest_.halvings[v]);
  }
  rest_.photos = std::move(photos);
  rest_.photos_of = wanted.view;
  rest_.photos_settings = wanted.settings;
  rest_.photos_missing = true;
  rest_.photos_reader = NewLoader();
  rest_.photos_reader->Ask(ask);
}

// Reads photos again that were not kept when they arrived, because refinement was off, or because they come and go.
bool Viewer::KeepPhotos(const RenderRequest& wanted) {
  if (!Settled()) return false;
  if (OnDemand() &&
      (!rest_.photos_of || rest_.photos_of->P != wanted.view.P || !(rest_.photos_settings == wanted.settings)))
    KeepPhotosOf(wanted);
  if (!rest_.photos_missing) return true;
  if (!rest_.photos_reader) {
    rest_.photos = std::make_shared<std::vector<Photo>>(scene_.views.size());
    rest_.photos_reader = NewLoader();
    std::vector<std::int32_t> all(scene_.views.size());
    std::iota(all.begin(), all.end(), 0);
    rest_.photos_reader->Ask(all);
  }
  while (auto loaded = rest_.photos_reader->Take())
    if (OnDemand() && loaded->error.empty())
      (*rest_.photos)[static_cast<std::size_t>(loaded->view.value)] =
          HalvedTo(loaded->photo, rest_.halvings[static_cast<std::size_t>(loaded->view.value)]);
    else if (!OnDemand() && gl_.Has(loaded->view))
      (*rest_.photos)[static_cast<std::size_t>(loaded->view.value)] = std::move(loaded->photo);
  if (rest_.photos_reader->outstanding() > 0) return false;
  rest_.photos_reader.reset();
  rest_.photos_missing = false;
  return true;
}

JsonKeys Viewer::RefinementSummary() const {
  JsonKeys j;
  j.Say("on", settings_.Refines()).Say("shown", !rest_.picture.empty()).Say("pictures", rest_.pictures);
  j.Say("cancelled", rest_.cancelled).Say("seconds", rest_.seconds).Say("problem", rest_.problem);
  return j.Say("settings", SettingsAtRest(settings_.radiance));
}

}  // namespace lumi
