// Sharpness: photos that show a place less sharply than others that see the same points (motion blur, defocus) rank
// behind. A photo's own number there, s in (0, 1], is the share of the fine detail's energy that it has left of what
// the sharpest of them have (render/effects/sharpness.h).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "render/radiance/measures/record.h"
#include "scene/model/photo_grid.h"

namespace lumi {

struct Photo;
struct Scene;
class ProgressSink;

namespace measure {

struct Sharpness {
  static constexpr std::string_view kName = "sharpness", kTitle = "sharpness";
  static constexpr bool kEffect = true;

  struct Settings {
    bool sharpness = false;
    double delta = 4;  // >= 0
    bool operator==(const Settings&) const = default;
  };
  static bool On(const Settings& s) { return s.sharpness; }
  static void Switch(Settings& s, bool on) { s.sharpness = on; }
  template <typename Table>
  static void Options(Table& table) {
    table.Switch("sharpness", &Settings::sharpness, "Photos that show a place less sharply than others rank behind",
                 "sharpness");
    table.Real("delta", &Settings::delta, kFactorRange, "Weight of the sharpness measure, >= 0",
               kFactorRow("its weight"));
  }

  static constexpr double kOwn = 1;
  static constexpr bool kPerPhoto = false;
  static double Factor(const Settings& s) { return s.sharpness ? s.delta : 0; }
  struct Shape {
    std::array<float, 4> Packed() const { return {}; }
  };
  static Shape ShapeOf(const Settings&) { return {}; }
  template <typename Sight>
  LUMI_INLINE static auto Value(const Sight& at, const Shape&) {
    return at.field();
  }
  static constexpr const char* kGlslValue = "SharpnessValue";
  static constexpr const char* kGlsl = R"(
float SharpnessValue(Sight s, vec4 shape) { return s.field; }
)";

  static constexpr std::string_view kHeatMapUnit = "", kHeatMapHelp = "How sharply that photo shows the place";
  static double Shown(double value, const Settings&) { return value; }
  static void ShowAll(Settings& s) { s.sharpness = true; }

  // None where all photos are as sharp.
  static std::vector<PhotoGrid> Estimate(const Scene& scene, const std::vector<Photo>* photos, ProgressSink& sink);

  class Evidence {
   public:
    explicit Evidence(const Settings&) {}
    void Look(std::span<const NearPhoto>) {}
    Verdict Decide(const ViewFacts& facts, Settings&) const {
      if (!facts.field || facts.field->value.empty()) return {false, "photos of one point are as sharp as one another"};
      long unsharp = 0;
      const auto cells = static_cast<std::size_t>(facts.field->columns * facts.field->rows);
      const std::vector<float>& value = facts.field->value;
      for (std::size_t first = 0; first < value.size(); first += cells) {
        float sum = 0;
        for (std::size_t c = first; c < first + cells; ++c) sum += value[c];
        unsharp += sum < kUnsharp * static_cast<float>(cells);
      }
      return {
          unsharp > 0,
          fmt::format(
              "{:.0f} % of the photos have less than {:.0f} % of the fine detail that others show of the same points",
              100 * Share(unsharp, static_cast<long>(value.size() / cells)), 100 * static_cast<double>(kUnsharp))};
    }

   private:
    static constexpr float kUnsharp = 0.7F;  // mean over a photo
  };
};

}  // namespace measure
}  // namespace lumi
