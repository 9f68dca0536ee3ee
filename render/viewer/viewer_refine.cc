// What the viewer does at rest: the picture by optimal weights at every pixel replaces that of the graphics processor when it is whole,
// and goes as soon as anything else is to be seen.
#include <algorithm>

#include "render/settings_json.h"
#include "render/viewer/viewer_app.h"

namespace lumi {
namespace {

constexpr double kRest_s = 0.15;         // without a change, before it begins
constexpr int kStandInGrid = 25;         // of samples: what is drawn of the optimum at every pixel until it is refined

}  // namespace

// What the graphics processor draws for the settings in the panel: of the optimum at every pixel, which is refined later, that
// of sparse samples.
RadianceSettings Viewer::Drawn() const {
  RadianceSettings s = settings_.radiance;
  if (!settings_.Refines() || s.similarity != Similarity::kFull || s.Sparse() || !Validate(s).empty()) return s;
  s.grid_columns = s.grid_rows = kStandInGrid;
  s.sampling = Sampling::kInterpolated;
  return s;
}

// What is to be seen at rest; nullopt: what the graphics processor draws.
std::optional<RenderRequest> Viewer::WantedRefinement() const {
  const bool samples_shown = settings_.seen.show == Show::kTessellation && settings_.radiance.Sparse();
  const bool other = settings_.seen.flat || settings_.seen.measure;
  const bool plays = playing_s_ || (settings_.play_time && settings_.radiance.time);
  if (!settings_.Refines() || samples_shown || other || plays) return std::nullopt;
  const RadianceSettings optimal = OptimalSettings(settings_.radiance);
  if (!Validate(optimal).empty()) return std::nullopt;
  return Request(size_px_, optimal);
}

bool Viewer::RefinementOpen() const { return refinement_wanted_ && !refinement_ended_ && !path_recording_ && !probe_.busy(); }

void Viewer::StopRefining() {
  if (!refiner_.busy()) return;
  refiner_.Cancel();
  ++refinements_cancelled_;
}

// After Paint. `moving`: the camera will have moved by the next picture.
void Viewer::StepRefinement(bool changed, bool moving) {
  const std::optional<RenderRequest> wanted = WantedRefinement();
  const bool same = wanted.has_value() == refinement_wanted_.has_value() && (!wanted || Same(*wanted, *refinement_wanted_)) &&
                    refinement_generation_ == generation_;
  if (!same) {
    StopRefining();
    refined_.Clear();
    refinement_ended_ = false;
    refinement_wanted_ = wanted;
    refinement_generation_ = generation_;
  }
  if (changed || moving || !same) resting_since_ = Clock::now();
  if (path_recording_ || probe_.busy()) StopRefining();  // what is measured and recorded has the machine to itself
  if (auto picture = refiner_.Take()) {
    refinement_ended_ = true;
    refinement_s_ = picture->seconds;
    refinement_problem_ = picture->problem;
    if (picture->problem.empty()) {
      refined_.Set(picture->image);
      ++refinements_;
    } else {
      Say(picture->problem);
    }
  }
  if (wanted && RefinementOpen() && !refiner_.busy() && KeepPhotos() && painter_.complete() && motion_.ToProbe() == nullptr &&
      SecondsSince(resting_since_) >= kRest_s)
    refiner_.Start({*wanted, gl_.sources(), proxy_tracer_, gl_.visibility(), photos_});
  facts_.refined = !refined_.empty();
  facts_.refining = refiner_.busy();
  facts_.refined_fraction = refiner_.fraction();
  facts_.refinement_s = refinement_s_;
}

// Photos that nobody wanted to keep when they came are read once more.
bool Viewer::KeepPhotos() {
  if (!Settled()) return false;
  if (!photos_missing_) return true;
  if (!photos_reader_) {
    photos_ = std::make_shared<std::vector<Photo>>(scene_.views.size());
    photos_reader_ = std::make_unique<PhotoLoader>(scene_, budget_.max_side_px, std::clamp(ThreadCount() - 1, 1, 6));
  }
  while (auto loaded = photos_reader_->Take())
    if (gl_.Has(loaded->view)) (*photos_)[static_cast<std::size_t>(loaded->view.value)] = std::move(loaded->photo);
  if (photos_reader_->outstanding() > 0) return false;
  photos_reader_.reset();
  photos_missing_ = false;
  return true;
}

nlohmann::json Viewer::RefinementSummary() const {
  nlohmann::json j;
  j["on"] = settings_.Refines();
  j["shown"] = !refined_.empty();
  j["pictures"] = refinements_;
  j["cancelled"] = refinements_cancelled_;
  j["seconds"] = refinement_s_;
  j["problem"] = refinement_problem_;
  j["settings"] = ToJson(OptimalSettings(settings_.radiance));
  return j;
}

}  // namespace lumi
