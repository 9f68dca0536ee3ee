// Settings for a given time per frame: from the scene's stored front, or from a probe of about two seconds; in a
// viewer, steps along the front follow the measured times of frames.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "render/radiance/decided.h"
#include "render/tradeoff/front.h"
#include "render/world/renderer.h"

namespace lumi {

struct BudgetChoice : FrontPoint {  // ms: expected
  double budget_ms = 0;
  bool fits = false;              // false: nothing measured was fast enough, this is the fastest
  std::string why;                // one line: where it comes from, what else was measured
  std::vector<FrontPoint> tried;  // the front, or what the probe measured, ascending in time
};
void ListKeys(JsonKeys& j, BudgetChoice& choice);

// Options that the user gave, by name and text: a budget does not change them.
using FixedOptions = std::vector<std::pair<std::string, std::string>>;
FixedOptions Fixed(const RadianceSettings& settings, const Decided& decided);

// Settings that a probe tries, cheapest first, each at least as accurate as the one before (measured on `desk`, see
// docs/tradeoff.md). With `fixed` applied; those that this makes equal or invalid are left out.
std::vector<FrontPoint> ProbeTable(const RadianceSettings& base, const FixedOptions& fixed);

// Renders `request` (its settings are replaced) with each of the table's settings in turn, until about `seconds` have
// passed or two in a row took over twice the budget. Returns the last that fits. Settings that the backend does not
// support are skipped.
BudgetChoice Probe(Renderer& renderer, RenderRequest request, const RadianceSettings& base, const FixedOptions& fixed,
                   double budget_ms, double seconds = 2);

// Chooses from the scene's front, if it has one with points that agree with `fixed`, else by a probe at `request`.
BudgetChoice ChooseForBudget(const std::filesystem::path& scene_folder, const std::string& backend,
                             const std::string& proxy, Renderer& renderer, const RenderRequest& request,
                             const FixedOptions& fixed, double budget_ms);

// Steps along a front while the camera moves, and refines when it rests. It reads no clock, so that tests can simulate
// times. Not thread-safe.
class BudgetController {
 public:
  struct Options {
    double budget_ms = 33;
    double rest_s = 0.25;    // the camera counts as resting after so long without a move
    double too_slow = 1.15;  // frames above this times the budget ...
    int slow_frames = 3;     // ... so many in a row: one step down; at once where a frame took twice the budget
    double room = 0.8;       // the next step's expected time must lie below this times the budget ...
    int fast_frames = 12;    // ... for so many frames: one step up
    int longest_wait = 400;  // a step up that had to be taken back waits twice as long, up to so many frames
  };

  // `front`: ascending in time and quality; `refined`: the point for a resting camera, e.g. the optimum at every pixel;
  // nullopt: the front's best. Throws std::invalid_argument for an empty front or a budget that is not above 0.
  BudgetController(std::vector<FrontPoint> front, std::optional<FrontPoint> refined, Options options);

  // The point for the next frame. now_s: any clock that ascends.
  const FrontPoint& Next(double now_s, bool camera_moved);
  // The time of the last frame that Next asked for. Frames of the refined point are ignored.
  void Measured(double ms);

  bool Refining() const { return refining_; }
  std::size_t level() const { return level_; }  // on the front
  double load() const { return load_; }         // measured over expected time, smoothed: how busy the machine is
  void SetBudget(double budget_ms);

 private:
  double Expected(std::size_t level) const { return front_[level].ms * load_; }

  std::vector<FrontPoint> front_;
  FrontPoint refined_;
  Options options_;
  std::size_t level_ = 0;
  double load_ = 1;
  bool refining_ = false, started_ = false;
  double last_move_s_ = 0;
  int slow_ = 0, fast_ = 0, wait_ = 0, since_up_ = 0;
};

}  // namespace lumi
