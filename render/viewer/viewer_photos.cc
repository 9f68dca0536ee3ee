// Photos on their way into graphics memory: all of them, those near the view first; or, where they do not fit into it,
// those that the view is blended from, those of the view ahead, and the nearest.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <string>

#include "render/photos/small_photos.h"
#include "render/viewer/viewer_app.h"
#include "scene/program/error.h"
#include "scene/program/interrupt.h"
#include "scene/program/memory.h"
#include "scene/program/out_of_memory.h"

namespace lumi {
namespace {

constexpr double kLoadedRefresh_s = 0.35;  // photos that arrive are shown in batches
constexpr double kUploadTime_s = 0.025;    // a frame
constexpr int kExposureSide = 256;         // of the photos whose exposures are compared
constexpr double kAskAgain_s = 0.15;       // while the camera moves
constexpr double kAhead_s = 1.0;           // the view then is prepared for, too
constexpr std::size_t kMostNear = 2000;    // cameras around the view whose photos are kept, as far as there is room

// Ends what reports to it by Interrupted.
class StoppableProgress final : public ProgressSink {
 public:
  explicit StoppableProgress(const std::atomic<bool>& stop) : stop_(stop) {}
  void Report(const std::string&, long, long, double, double) override {
    if (stop_) throw Interrupted();
  }
  void Finish(const std::string&, long, double) override {}
  void Message(const std::string&) override {}

 private:
  const std::atomic<bool>& stop_;
};

}  // namespace

Viewer::~Viewer() { arriving_.stop_copies = true; }

std::vector<Eigen::Vector2i> Viewer::PhotoSizes() const {
  std::vector<Eigen::Vector2i> sizes;
  for (const View& v : scene_.views) sizes.emplace_back(scene_.CameraOf(v).width_px, scene_.CameraOf(v).height_px);
  return sizes;
}

// Bytes of graphics memory for photos.
std::size_t Viewer::RoomForPhotos(const VisibilityMaps& maps) const {
  constexpr std::size_t kMiB = std::size_t{1} << 20;
  constexpr std::size_t kLeast = 16 * kMiB;
  // Photos being read, the window, and what the driver keeps.
  constexpr std::size_t kOthers = 192 * kMiB;
  const std::size_t limit = static_cast<std::size_t>(options_.memory_mb) * kMiB,
                    taken = ResidentMemory() + kOthers + maps.bytes();  // the maps are held twice
  return std::max(kLeast, limit > taken ? limit - taken : 0);
}

// How often small copies of all photos are halved, which are held beside those that come and go; -1: there are none.
int Viewer::SmallHalvings() const { return CallsForSmallPhotos(scene_) ? CopyHalvings(scene_) : -1; }

// Sets all photos to be read. Where all are held, those that are loaded are drawn until then.
void Viewer::ReadAll() {
  arriving_.loader = NewLoader();
  arriving_.open.assign(scene_.views.size(), true);
  arriving_.asked_view.reset();
  AskForPhotos();
}

// The photos of the request come first, then those of the view ahead and the nearest.
void Viewer::WantOnDemand(const RenderRequest& request, const RenderRequest* ahead) {
  const auto count = scene_.views.size();
  std::vector<WantedPhoto> wanted = gl_.PhotosWanted(request);
  std::vector<bool> listed(count, false);
  for (const WantedPhoto& w : wanted) listed[static_cast<std::size_t>(w.photo)] = true;
  arriving_.needed = listed;
  const auto add = [&](const WantedPhoto& w) {
    if (listed[static_cast<std::size_t>(w.photo)]) return;
    listed[static_cast<std::size_t>(w.photo)] = true;
    wanted.push_back(w);
  };
  if (ahead != nullptr)
    for (const WantedPhoto& w : gl_.PhotosWanted(*ahead)) add(w);
  // Until all photos have small copies.
  if (!arriving_.small_copies) {
    const Rigid3& camera = steering_.navigator.state().cam_from_world;
    std::vector<std::pair<double, std::int32_t>> near;
    for (std::size_t v = 0; v < count; ++v)
      near.emplace_back(CameraDistance(scene_, camera, scene_.views[v].cam_from_world), static_cast<std::int32_t>(v));
    const std::size_t kept = std::min(count, kMostNear);
    std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(kept), near.end());
    for (std::size_t i = 0; i < kept; ++i) add({near[i].second, kSlotSizes - 1});
  }
  gl_.WantPhotos(wanted);
  AskForMissing();
}

bool Viewer::CopiesReady() const {
  return !arriving_.reading_copies.valid() ||
         arriving_.reading_copies.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

// Copies of all photos are read, or made, on another thread, and uploaded a few a frame.
void Viewer::TakeSmallCopies() {
  if (!OnDemand() || small_halvings_ < 0 || arriving_.small_copies) return;
  if (arriving_.copies.empty()) {
    if (!arriving_.reading_copies.valid())
      arriving_.reading_copies = std::async(std::launch::async, [this, halvings = small_halvings_] {
        StoppableProgress until(arriving_.stop_copies);
        return ReadSmallPhotos(scene_, halvings, until);
      });
    if (!CopiesReady()) return;
    try {
      arriving_.copies = arriving_.reading_copies.get();
    } catch (const std::exception& e) {  // those near the view stand in
      MemoryIsBack();
      small_halvings_ = -1;
      Say(std::string("small copies of the photos: ") + e.what());
      return;
    }
    arriving_.copies_taken = 0;
  }
  const auto start = Clock::now();
  while (arriving_.copies_taken < arriving_.copies.size() && SecondsSince(start) < kUploadTime_s) {
    const std::size_t v = arriving_.copies_taken++;
    gl_.UploadSmallCopy({static_cast<std::int32_t>(v)}, arriving_.copies[v]);
    arriving_.copies[v] = {};
  }
  if (arriving_.copies_taken < arriving_.copies.size()) return;
  arriving_.copies.clear();
  arriving_.small_copies = true;
  arriving_.asked_view.reset();
  ++generation_;
}

// What is wanted and not there, in this order. Counts what the view needs of it.
void Viewer::AskForMissing() {
  std::vector<std::int32_t> ask;
  arriving_.needed_open = 0;
  for (const PhotoSlots::Wish& m : gl_.slots()->missing()) {
    ask.push_back(m.photo);
    if (arriving_.needed[static_cast<std::size_t>(m.photo)]) ++arriving_.needed_open;
  }
  arriving_.loader->Ask(ask);
}

// The view in a second, along the path that is played or as the camera moved last.
std::optional<RenderRequest> Viewer::RequestAhead(const RenderRequest& now) const {
  RenderRequest ahead = now;
  ViewState state = steering_.navigator.state();
  if (playing_s_) {
    const double t = path_.keys.front().time_s + std::min(*playing_s_ + kAhead_s, Duration(path_));
    state = StateOfKey(PoseOnPath(path_, t));
  } else if (arriving_.asked_view) {
    const double seconds = SecondsSince(arriving_.asked);
    if (seconds > kAhead_s || seconds <= 0) return std::nullopt;
    const Eigen::Vector3d centre = state.cam_from_world.OriginInSource(),
                          moved = kAhead_s / seconds * (centre - arriving_.asked_view->centre);
    if (moved.norm() == 0) return std::nullopt;
    state.cam_from_world.translation = -(state.cam_from_world.rotation * (centre + moved));
  } else {
    return std::nullopt;
  }
  ahead.view = MakeWindowView(state, now.view.size_px.x(), now.view.size_px.y());
  return ahead;
}

void Viewer::AskForPhotos() {
  if (OnDemand() && (jobs_.path_recording || jobs_.probe.busy())) return;  // they ask for their own (PhotosAreHere)
  const RenderRequest now = Request(size_px_.cwiseMax(1), SettingsToAskFor());
  if (arriving_.asked_view && ((arriving_.asked_view->P == now.view.P && arriving_.asked_settings == now.settings) ||
                               SecondsSince(arriving_.asked) < kAskAgain_s))
    return;
  if (OnDemand()) {
    const std::optional<RenderRequest> ahead = RequestAhead(now);
    WantOnDemand(now, ahead ? &*ahead : nullptr);
  } else {
    std::vector<std::pair<double, std::int32_t>> open;
    for (std::size_t v = 0; v < arriving_.open.size(); ++v)
      if (arriving_.open[v])
        open.emplace_back(
            CameraDistance(scene_, steering_.navigator.state().cam_from_world, scene_.views[v].cam_from_world),
            static_cast<std::int32_t>(v));
    std::ranges::sort(open);
    std::vector<std::int32_t> ask;
    for (const auto& [distance, v] : open) ask.push_back(v);
    arriving_.loader->Ask(ask);
  }
  arriving_.asked_view = now.view;
  arriving_.asked_settings = now.settings;
  arriving_.asked = Clock::now();
}

// Whether a picture that is not the window's may be drawn; asks for what is missing.
bool Viewer::PhotosAreHere(const RenderRequest& request) {
  if (!OnDemand()) return true;
  if (!arriving_.asked_view || arriving_.asked_view->P != request.view.P ||
      !(arriving_.asked_settings == request.settings)) {
    WantOnDemand(request, nullptr);
    arriving_.asked_view = request.view;
    arriving_.asked_settings = request.settings;
    arriving_.asked = Clock::now();
  }
  return arriving_.needed_open == 0;
}

// A small copy, for the photos' exposures.
void Viewer::KeepForExposure(ViewId view, const Photo& photo) {
  if (!arriving_.estimates_wanted || OnDemand()) return;
  std::size_t level = 0;
  while (level + 1 < photo.levels.size() &&
         std::max(photo.levels[level].width, photo.levels[level].height) > kExposureSide)
    ++level;
  Photo& kept = arriving_.small_photos[static_cast<std::size_t>(view.value)];
  kept.levels.assign(photo.levels.begin() + static_cast<std::ptrdiff_t>(level), photo.levels.end());
  kept.level0_shift = photo.level0_shift + static_cast<int>(level);
}

void Viewer::Keep(PhotoLoader::Loaded loaded) {
  const auto v = static_cast<std::size_t>(loaded.view.value);
  if (OnDemand()) {
    for (const PhotoSlots::Wish& m : gl_.slots()->missing())
      if (m.photo == loaded.view.value) gl_.Offer(loaded.view, loaded.photo, m.halvings);
    arriving_.new_photos |= arriving_.needed[v];
    return AskForMissing();
  }
  arriving_.open[v] = false;
  gl_.Upload(loaded.view, loaded.photo);
  if (!arriving_.gains.empty()) {
    arriving_.gains[v] = scene_.views[v].gain;
    gl_.SetCameras(SourcesAsDrawn());
  }
  KeepForExposure(loaded.view, loaded.photo);
  if (settings_.Refines())
    (*rest_.photos)[v] = std::move(loaded.photo);
  else
    rest_.photos_missing = true;
  arriving_.new_photos = true;
}

void Viewer::TakePhotos() {
  // What comes now would take the places of photos that the picture is being drawn from.
  const bool hold = OnDemand() && arriving_.needed_open == 0 && HalfDrawn();
  if (!hold) TakeSmallCopies();
  const auto start = Clock::now();
  while (!hold && SecondsSince(start) < kUploadTime_s) {
    std::optional<PhotoLoader::Loaded> loaded = arriving_.loader->Take();
    if (!loaded) break;
    const auto v = static_cast<std::size_t>(loaded->view.value);
    const Camera& camera = scene_.CameraOf(scene_.views[v]);
    const Image8* first = loaded->photo.levels.empty() ? nullptr : &loaded->photo.levels.front();
    if (first != nullptr && (first->width != camera.width_px || first->height != camera.height_px))
      loaded->error = scene_.views[v].name + " is not of its camera's size";
    if (loaded->error.empty()) {
      Keep(std::move(*loaded));
      continue;
    }
    ++facts_.photos_failed;
    arriving_.open[v] = false;
    if (OnDemand()) {
      gl_.GiveUp(loaded->view);
      AskForMissing();
    }
    progress_.Message(loaded->error);
    Say(loaded->error);
  }
  if (facts_.photos_failed == facts_.photos_total)
    throw InputError(scene_.image_folder, "none of the photos could be read: " + message());
  facts_.photos_loaded = gl_.photo_count();
  facts_.photo_mb = static_cast<double>(gl_.photo_bytes()) / kMb;
  if (arriving_.new_photos && (PhotosOpen() == 0 || SecondsSince(arriving_.last_refresh) > kLoadedRefresh_s)) {
    ++generation_;
    arriving_.new_photos = false;
    arriving_.last_refresh = Clock::now();
  }
}

// While the panel's settings are invalid, the earlier ones are drawn.
RadianceSettings Viewer::SettingsToAskFor() const {
  const RadianceSettings wanted = Drawn();
  return Validate(wanted).empty() ? wanted : drawn_.settings;
}

bool Viewer::AskedForThis() const {
  if (!OnDemand() || jobs_.path_recording || jobs_.probe.busy()) return true;
  if (small_halvings_ >= 0 && !arriving_.small_copies) return false;
  const RenderRequest now = Request(size_px_, SettingsToAskFor());
  return arriving_.asked_view && arriving_.asked_view->P == now.view.P && arriving_.asked_settings == now.settings;
}

// A picture is being drawn in strips, all from the photos that were there when it was begun.
bool Viewer::HalfDrawn() const {
  return !painter_.complete() || (jobs_.path_recording && jobs_.path_recording->painter.busy()) ||
         jobs_.probe.drawing();
}

int Viewer::PhotosOpen() const { return OnDemand() ? arriving_.needed_open : arriving_.loader->outstanding(); }

}  // namespace lumi
