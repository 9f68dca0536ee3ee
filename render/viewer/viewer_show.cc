// What the viewer shows beside the lumigraph's picture: heat maps of the measures, and the difference to a photo.
#include "render/viewer/viewer_app.h"

namespace lumi {
namespace {

// Of the window's side: each pixel of a heat map asks for all photos' measures.
constexpr double kHeatScale = 0.5;
constexpr double kPlayingHeat_s = 0.2;  // between two while time plays

}  // namespace

// On a thread of its own, one after another; the window never waits. While the camera moves the last one stays.
void Viewer::StepHeatMap() {
  if (heat_drawing_.valid() && heat_drawing_.wait_for(std::chrono::seconds(0)) == std::future_status::ready) {
    try {
      const MeasureMap map = heat_drawing_.get();
      heat_.Set(map.image);
      facts_.heat_low = map.low;
      facts_.heat_high = map.high;
      facts_.heat_unit = map.unit;
      heat_drawn_ = heat_wanted_;
      heat_drawn_generation_ = heat_wanted_generation_;
    } catch (const Error& e) {
      settings_.seen = {};
      Complain(e);
    }
  }
  if (!settings_.seen.measure) {
    heat_.Clear();
    heat_drawn_.reset();
    facts_.heat = false;
    return;
  }
  facts_.heat = !heat_.empty();
  if (heat_drawing_.valid() || proxy_tracer_ == nullptr || !Validate(settings_.radiance).empty()) return;
  const Eigen::Vector2i size_px = (kHeatScale * size_px_.cast<double>()).cast<int>().cwiseMax(1);
  const HeatRequest wanted{Request(size_px, settings_.radiance), *settings_.seen.measure};
  if (HeatIsShown(wanted)) return;
  const bool plays = settings_.play_time && settings_.radiance.time;
  if (plays && SecondsSince(heat_begun_) < kPlayingHeat_s) return;
  heat_begun_ = Clock::now();
  heat_wanted_ = wanted;
  heat_wanted_generation_ = generation_;
  heat_drawing_ = std::async(std::launch::async, [wanted, sources = gl_.sources(), tracer = proxy_tracer_, maps = gl_.visibility()] {
    return RenderMeasureMap(sources, *tracer, maps ? *maps : VisibilityMaps(), wanted.request, wanted.measure, -1);
  });
}

bool Viewer::HeatIsShown(const HeatRequest& wanted) const {
  return heat_drawn_ && heat_drawn_generation_ == generation_ && heat_drawn_->measure == wanted.measure && Same(heat_drawn_->request, wanted.request);
}

// A script's 'wait': the heat map of what is seen now.
bool Viewer::HeatOpen() const {
  if (!settings_.seen.measure) return false;
  const Eigen::Vector2i size_px = (kHeatScale * size_px_.cast<double>()).cast<int>().cwiseMax(1);
  return heat_drawing_.valid() || !HeatIsShown({Request(size_px, settings_.radiance), *settings_.seen.measure});
}

void Viewer::ShowDifference(const Image8& difference) {
  ImageF picture(difference.width, difference.height, 4);
  for (std::size_t p = 0; p < picture.data.size() / 4; ++p) {
    for (std::size_t c = 0; c < 3; ++c) picture.data[4 * p + c] = static_cast<float>(difference.data[3 * p + c]) / 255.0F;
    picture.data[4 * p + 3] = 1;
  }
  difference_.Set(picture);
  facts_.difference_texture = difference_.texture();
  facts_.difference_aspect = static_cast<double>(difference.width) / std::max(1, difference.height);
}

}  // namespace lumi
