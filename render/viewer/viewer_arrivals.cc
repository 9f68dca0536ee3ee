// What reaches the viewer from other threads beside photos: their exposures, proxies.
#include <fmt/format.h>

#include <algorithm>
#include <future>

#include "render/viewer/viewer_app.h"
#include "scene/program/error.h"

namespace lumi {
void Viewer::SetProxy(PreparedProxy proxy) {
  gl_.SetProxy(proxy.mesh, std::move(proxy.visibility), proxy.tracer);
  proxy_tracer_ = std::move(proxy.tracer);
  arriving_.asked_view.reset();
  rest_.photos_of.reset();
  facts_.proxy = proxy.name;
  facts_.faces = static_cast<int>(proxy.mesh.faces.size());
  ++generation_;
}

// When photos are loaded, estimates are made from all of them on another thread and then used for drawing. Exposures
// need only small copies; other estimates, and all where photos come and go, need full photos and read them again.
void Viewer::TakeEstimates() {
  if (arriving_.estimates_wanted && !arriving_.estimates.valid() && !Loading()) {
    arriving_.estimates_wanted = false;
    const auto wanted = [decided = decided_](std::string_view effect) { return !decided.Has(effect); };
    arriving_.estimates = std::async(std::launch::async, [this, wanted, photos = std::move(arriving_.small_photos)] {
      const auto exposure = [](std::string_view effect) { return effect == measure::Exposure::kName; };
      if (photos.empty()) return EstimateFromPhotos(scene_, nullptr, wanted, SilentProgress());
      const auto others = [&](std::string_view effect) { return !exposure(effect) && wanted(effect); };
      PhotoEstimates found = EstimateFromPhotos(scene_, nullptr, others, SilentProgress());
      found.exposures = EstimateFromPhotos(scene_, &photos, exposure, SilentProgress()).exposures;
      return found;
    });
  }
  facts_.effects_open = arriving_.estimates.valid() || arriving_.estimates_wanted;
  if (!arriving_.estimates.valid() ||
      arriving_.estimates.wait_for(std::chrono::seconds(0)) != std::future_status::ready)
    return;
  // No other thread may read the scene's views while they change.
  if (!CopiesReady()) return;
  if (OnDemand()) arriving_.loader.reset();
  arriving_.estimated = arriving_.estimates.get();
  lumigraph_.SetEstimates(*arriving_.estimated);
  facts_.effects_open = false;
  const EffectChoice seen = lumigraph_.MeasuresCalledForByPhotos();
  lumigraph_.Correct(*arriving_.estimated, {});  // as the photos were read
  if (OnDemand()) {
    arriving_.loader = NewLoader();
    arriving_.asked_view.reset();
  }
  gl_.SetCameras(MakeSources(scene_));
  for (std::size_t i = 0; i < effects_.effects.size(); ++i) {
    if (!seen.effects[i].from_photos) continue;
    effects_.effects[i] = seen.effects[i];
    if (options_.effects == "auto" && !decided_.Has(seen.effects[i].name)) {
      SwitchEffect(settings_.radiance, seen.effects[i].name, seen.effects[i].on);
      if (seen.effects[i].on) ++generation_;
    }
  }
  facts_.effects = effects_.effects;
  if (settings_.radiance.exposure) ++generation_;
}

// White balance and vignetting are corrected when photos are read: if the wanted corrections change, all photos are
// read again in the background. Until a photo is loaded, its former pixels are drawn with their former gain.
void Viewer::ReadCorrected() {
  if (!arriving_.gains.empty() && arriving_.loader->outstanding() == 0 && !arriving_.new_photos) {
    arriving_.gains.clear();
    ++generation_;
  }
  if (!arriving_.estimated || !arriving_.estimated->exposures || Loading() || !arriving_.gains.empty()) return;
  const RadianceSettings& s = settings_.radiance;
  const Corrections wanted{s.exposure && s.white_balance, s.exposure && s.vignetting};
  // No other thread may read the scene's views while they change.
  if (wanted == lumigraph_.corrections() || Working() || arriving_.proxy.valid() || heat_.drawing.valid()) return;
  if (!CopiesReady()) return;
  StopRefining();
  rest_.photos_reader.reset();
  rest_.photos_of.reset();
  rest_.photos = std::make_shared<std::vector<Photo>>(scene_.views.size());
  rest_.photos_missing = false;
  if (OnDemand())
    gl_.DropPhotos();
  else
    for (const View& v : scene_.views) arriving_.gains.push_back(v.gain);
  arriving_.reading_copies = {};  // they are corrected, too
  arriving_.copies.clear();
  arriving_.small_copies = false;
  arriving_.loader.reset();  // it reads the scene's views, which change now
  lumigraph_.Correct(*arriving_.estimated, wanted);
  if (OnDemand()) {
    gl_.SetCameras(MakeSources(scene_));
    ++generation_;
  }
  ReadAll();
}

// The cameras, each with the gain of the pixels that it is drawn with.
Sources Viewer::SourcesAsDrawn() const {
  Sources sources = MakeSources(scene_);
  for (std::size_t i = 0; i < arriving_.gains.size(); ++i) sources.views[i].gain = arriving_.gains[i];
  return sources;
}

void Viewer::WishProxy(const std::string& name) {
  if (name == facts_.proxy || arriving_.proxy.valid()) return;
  arriving_.proxy = std::async(std::launch::async, [this, name, sources = gl_.sources()] {
    return PrepareProxy(name, LoadProxy(scene_, name), sources);
  });
}

void Viewer::TakeProxy() {
  facts_.proxy_loading = arriving_.proxy.valid();
  if (!facts_.proxy_loading || arriving_.proxy.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
  try {
    SetProxy(arriving_.proxy.get());
  } catch (const Error& e) {
    Complain(e);
  }
}

}  // namespace lumi
