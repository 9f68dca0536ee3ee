#include "render/viewer/refiner.h"

#include <exception>
#include <utility>

#include "render/cpu/pixels.h"
#include "scene/program/out_of_memory.h"
#include "scene/program/stopwatch.h"

namespace lumi {

RadianceSettings OptimalSettings(const RadianceSettings& settings) {
  RadianceSettings s = settings;
  s.similarity = Similarity::kFull;
  s.correlation = Correlation::kFallingLeaves;
  s.grid_columns = s.grid_rows = 0;
  return s;
}

Refiner::Refiner() : thread_([this] { Work(); }) {}

Refiner::~Refiner() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
    ++number_;
  }
  more_.notify_all();
  thread_.join();
}

void Refiner::Start(Refinement wanted) {
  {
    const std::lock_guard lock(mutex_);
    ++number_;
    next_ = std::move(wanted);
    done_.reset();
    busy_ = true;
    tiles_ = PixelTiles(next_->request.view.size_px.x(), next_->request.view.size_px.y());
    tiles_drawn_ = 0;
  }
  more_.notify_all();
}

void Refiner::Cancel() {
  const std::lock_guard lock(mutex_);
  ++number_;
  next_.reset();
  done_.reset();
  busy_ = false;
}

bool Refiner::busy() const {
  const std::lock_guard lock(mutex_);
  return busy_;
}

double Refiner::fraction() const {
  const int all = tiles_;
  return all > 0 ? std::min(1.0, static_cast<double>(tiles_drawn_) / all) : 0.0;
}

std::optional<RefinedPicture> Refiner::Take() {
  const std::lock_guard lock(mutex_);
  std::optional<RefinedPicture> taken = std::exchange(done_, std::nullopt);
  if (taken) busy_ = false;
  return taken;
}

void Refiner::Work() {
  for (;;) {
    Refinement wanted;
    long number = 0;
    {
      std::unique_lock lock(mutex_);
      more_.wait(lock, [this] { return stop_ || next_; });
      if (stop_) return;
      wanted = std::move(*next_);
      next_.reset();
      number = number_;
    }
    RefinedPicture picture = Draw(wanted, number);
    const std::lock_guard lock(mutex_);
    if (number == number_) done_ = std::move(picture);
  }
}

RefinedPicture Refiner::Draw(const Refinement& wanted, long number) {
  RefinedPicture picture;
  const auto start = std::chrono::steady_clock::now();
  try {
    const bool false_color = wanted.request.show == Show::kFalseColor;
    std::vector<bool> use = wanted.request.use;
    if (!false_color) {
      if (use.empty()) use.assign(wanted.photos->size(), true);
      for (std::size_t j = 0; j < use.size(); ++j) use[j] = use[j] && !(*wanted.photos)[j].levels.empty();
    }
    const ViewSetup setup = MakeViewSetup(wanted.sources, wanted.request.view, wanted.request.settings, use);
    std::vector<Eigen::Vector3f> colors;
    for (std::size_t j = 0; false_color && j < wanted.sources.views.size(); ++j)
      colors.push_back(SourceColor(static_cast<int>(j)));
    const bool hides = wanted.request.settings.visibility && wanted.visibility && !wanted.visibility->empty();
    picture.image = ImageF(wanted.request.view.size_px.x(), wanted.request.view.size_px.y(), 4);
    RenderPixels(
        wanted.sources, setup, *wanted.proxy, hides ? wanted.visibility.get() : nullptr,
        {wanted.photos.get(), false_color ? &colors : nullptr},
        [&] {
          if (number_.load(std::memory_order_relaxed) != number) return true;
          tiles_drawn_.fetch_add(1, std::memory_order_relaxed);
          return false;
        },
        picture.image);
  } catch (const std::exception& e) {
    MemoryIsBack();
    picture.problem = e.what();
  }
  picture.seconds = SecondsSince(start);
  return picture;
}

}  // namespace lumi
