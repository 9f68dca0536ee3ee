// What the viewer shows beside the lumigraph's picture, or in place of it: heat maps of the measures, the picture with
// its holes filled, and the difference to a photo.
#include <cmath>

#include "render/radiance/frame_plan.h"
#include "render/show/legend.h"
#include "render/viewer/viewer_app.h"

namespace lumi {
namespace {

// Heat maps are drawn at this share of the window's side, because each pixel evaluates all photos' measures.
constexpr double kHeatScale = 0.5;
constexpr double kPlayingHeat_s = 0.2;  // between two while time plays

// Of the picture whose weights a legend counts.
Eigen::Vector2i LegendSize(const Eigen::Vector2i& window_px) {
  constexpr double kWidth = 160;
  return (kWidth / window_px.x() * window_px.cast<double>()).cast<int>().cwiseMax(1);
}

}  // namespace

// Draws heat maps on another thread, one after another; the window never waits. While the camera moves, the last one
// stays.
void Viewer::StepHeatMap() {
  if (heat_.drawing.valid() && heat_.drawing.wait_for(std::chrono::seconds(0)) == std::future_status::ready) {
    try {
      const MeasureMap map = heat_.drawing.get();
      heat_.picture.Set(map.image);
      facts_.heat_low = map.low;
      facts_.heat_high = map.high;
      facts_.heat_unit = map.unit;
      heat_.drawn = heat_.wanted;
      heat_.drawn_generation = heat_.wanted_generation;
    } catch (const Error& e) {
      settings_.seen = {};
      Complain(e);
    }
  }
  if (!settings_.seen.measure) {
    heat_.picture.Clear();
    heat_.drawn.reset();
    facts_.heat = false;
    return;
  }
  facts_.heat = !heat_.picture.empty();
  if (heat_.drawing.valid() || proxy_tracer_ == nullptr || !Validate(settings_.radiance).empty()) return;
  const Eigen::Vector2i size_px = (kHeatScale * size_px_.cast<double>()).cast<int>().cwiseMax(1);
  const HeatRequest wanted{Request(size_px, settings_.radiance), *settings_.seen.measure};
  if (HeatIsShown(wanted)) return;
  const bool plays = settings_.play_time && settings_.radiance.time;
  if (plays && SecondsSince(heat_.begun) < kPlayingHeat_s) return;
  heat_.begun = Clock::now();
  heat_.wanted = wanted;
  heat_.wanted_generation = generation_;
  heat_.drawing = std::async(
      std::launch::async, [wanted, sources = gl_.sources(), tracer = proxy_tracer_, maps = gl_.visibility()] {
        return RenderMeasureMap(sources, *tracer, maps ? *maps : VisibilityMaps(), wanted.request, wanted.measure, -1);
      });
}

// The legend of false colours, once the camera rests: weights at the pixels of a small picture, on another thread.
void Viewer::StepColorLegend() {
  ColorLegend& l = color_legend_;
  if (l.counting.valid() && l.counting.wait_for(std::chrono::seconds(0)) == std::future_status::ready) {
    facts_.color_legend = LegendOf(scene_, l.counting.get());
    l.counted = l.wanted;
  }
  if (settings_.seen.show != Show::kFalseColor || settings_.seen.flat || settings_.seen.measure) {
    facts_.color_legend.clear();
    l.counted.reset();
    return;
  }
  if (l.counting.valid() || steering_.moving || !ColorLegendOpen()) return;
  l.wanted = Request(LegendSize(size_px_), drawn_.settings);
  l.generation = generation_;
  l.counting = std::async(std::launch::async, [wanted = *l.wanted, sources = gl_.sources(), tracer = proxy_tracer_,
                                               maps = gl_.visibility()] {
    RadianceSettings settings = wanted.settings;
    settings.grid_columns = settings.grid_rows = 0;
    const bool hides = settings.visibility && maps && !maps->empty();
    FramePlan plan;
    WeighScratch scratch;
    PlanPixels(MakeViewSetup(sources, wanted.view, settings), *tracer, hides ? maps.get() : nullptr,
               {0, 0, wanted.view.size_px.x(), wanted.view.size_px.y()}, plan, scratch);
    std::vector<double> shares(sources.views.size(), 0);
    for (std::size_t i = 0; i < plan.camera.size(); ++i)
      if (plan.camera[i] >= 0)
        shares[static_cast<std::size_t>(plan.camera[i])] +=
            std::abs(static_cast<double>(plan.weight[i])) / static_cast<double>(plan.alpha.size());
    return shares;
  });
}

bool Viewer::ColorLegendOpen() const {
  const ColorLegend& l = color_legend_;
  if (settings_.seen.show != Show::kFalseColor || settings_.seen.flat || settings_.seen.measure || !drawn_.request ||
      proxy_tracer_ == nullptr)
    return false;
  return l.counting.valid() || !l.counted || l.generation != generation_ ||
         !Same(*l.counted, Request(LegendSize(size_px_), drawn_.settings));
}

bool Viewer::HeatIsShown(const HeatRequest& wanted) const {
  return heat_.drawn && heat_.drawn_generation == generation_ && heat_.drawn->measure == wanted.measure &&
         Same(heat_.drawn->request, wanted.request);
}

// A script's 'wait': the heat map of what is seen now.
bool Viewer::HeatOpen() const {
  if (!settings_.seen.measure) return false;
  const Eigen::Vector2i size_px = (kHeatScale * size_px_.cast<double>()).cast<int>().cwiseMax(1);
  return heat_.drawing.valid() || !HeatIsShown({Request(size_px, settings_.radiance), *settings_.seen.measure});
}

// Fills the holes of the picture that Compose shows, once for each picture: at rest nothing is filled again.
void Viewer::FillHoles() {
  const bool shown = settings_.Fills() && !painter_.empty();
  const bool again = !filled_.shown || painter_.painted();
  filled_.shown = shown;
  if (!shown) return;
  const bool refined = !rest_.picture.empty();
  const unsigned texture = refined ? rest_.picture.texture() : painter_.shown().color_texture();
  const Eigen::Vector2i size_px = refined ? rest_.picture.size_px() : painter_.shown_size_px();
  const long refinement = refined ? rest_.pictures : 0;
  if (!again && texture == filled_.of_texture && refinement == filled_.of_refined && size_px == filled_.of_size_px)
    return;
  filled_.picture.Fill(texture, size_px);
  filled_.of_texture = texture;
  filled_.of_refined = refinement;
  filled_.of_size_px = size_px;
}

void Viewer::ShowDifference(const Image8& difference) {
  ImageF picture(difference.width, difference.height, 4);
  for (std::size_t p = 0; p < picture.data.size() / 4; ++p) {
    for (std::size_t c = 0; c < 3; ++c)
      picture.data[4 * p + c] = static_cast<float>(difference.data[3 * p + c]) / 255.0F;
    picture.data[4 * p + 3] = 1;
  }
  jobs_.difference.Set(picture);
  facts_.difference_texture = jobs_.difference.texture();
  facts_.difference_aspect = static_cast<double>(difference.width) / std::max(1, difference.height);
}

}  // namespace lumi
