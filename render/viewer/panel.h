// The viewer's panel (Dear ImGui): what it shows, and what the user asked for in it. panel.cc frames it,
// panel_settings.cc holds the reconstruction's options, panel_path.cc the camera path and recording.
#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "render/effects/effects.h"
#include "render/path/camera_path.h"
#include "render/radiance/settings.h"
#include "render/show/legend.h"
#include "render/viewer/error_probe.h"
#include "render/viewer/script.h"
#include "render/viewer/seen.h"

namespace lumi {

// What the user may change; keys and scripts change the same.
struct ViewerSettings {
  RadianceSettings radiance;
  Seen seen;
  bool frusta = false;
  bool mesh = false;
  bool path = true;  // the camera path in the picture
  bool fill = true;  // fill holes smoothly from around them; only in colour pictures
  bool Fills() const { return fill && seen == Seen{} && !difference; }  // a difference is of the picture with holes
  bool panel = true;
  bool help = false;
  bool difference = false;     // shows the last measured difference, in a window of its own
  bool play_time = false;      // the view's time goes on by itself
  double budget_ms = 0;        // a frame while the camera moves; 0: settings stay, the size adapts
  std::optional<bool> refine;  // to optimal weights at rest; unset: only with a budget, or if the optimum is asked for
  bool Refines() const {
    if (radiance.method != Algorithm::kUlr) return true;
    return refine.value_or(budget_ms > 0 || radiance.similarity == Similarity::kFull);
  }
  std::map<std::string, bool> groups;  // of the panel: open or closed, if the user or a script set them
  int selected_key = -1;
  double distance_m = 1;  // true distance between the two marks, entered by the user
  std::array<char, 256> path_file{}, video_file{};
};

struct PanelFacts {
  std::string scene, device;
  double picture_ms = 0;  // the last whole picture, smoothed
  double plan_ms = 0;     // the part spent on the CPU before the graphics processor draws
  double frame_ms = 0;    // from frame to frame, smoothed
  double scale = 1;       // of the shown picture against the window
  bool complete = false;
  int photos_loaded = 0, photos_total = 0, photos_failed = 0;
  double photo_mb = 0, budget_mb = 0;
  bool on_demand = false;  // photos come and go, because not all fit
  std::vector<std::string> photo_names;
  int nearest_photo = -1;
  std::vector<std::string> proxies;
  std::string proxy;  // the one that is shown
  int faces = 0;
  bool proxy_loading = false;
  std::string message;     // a line that fades
  std::string problem;     // why the settings are not what is shown: they are invalid, or this backend does not do them
  std::string budget_now;  // settings that the budget chose for the moving camera
  bool refined = false;    // what is shown has optimal weights at every pixel
  bool refining = false;   // that picture is being drawn
  double refined_fraction = 0, refinement_s = 0;

  std::vector<Effect> effects;            // as the data call for them
  bool effects_open = false;              // the photos' effects are still being estimated
  std::pair<double, double> times{0, 0};  // of the photos, seconds; equal: they have none
  double period_s = 0;

  // The heat map that is shown: values at the ends of its colour scale.
  bool heat = false;
  double heat_low = 0, heat_high = 0;
  std::string heat_unit;

  std::vector<LegendEntry> color_legend;  // of false colours at rest: which photo is which colour

  std::vector<Eigen::Vector3d> marks;     // in world; the last two
  std::optional<double> metres_per_unit;  // of the scene

  bool measuring = false;
  unsigned difference_texture = 0;    // of the error measured last; 0: there is none
  double difference_aspect = 1;       // width over height
  std::vector<MeasuredError> errors;  // latest last

  CameraPath path;
  bool playing = false;
  double play_s = 0;
  bool recording = false, recording_live = false;
  double recorded = 0;  // fraction of the path; live: seconds
  std::string recording_to;
  std::string exporting;  // current task of the web page's export; empty: there is none
};

enum class RecordWish { kNone, kPath, kLive, kStop, kCancel };

struct PanelWishes {
  std::optional<int> jump_to;
  std::optional<std::string> proxy;
  bool screenshot = false;
  bool home = false;
  bool auto_effects = false;
  bool measure = false;
  std::optional<double> distance_m;  // between the two marks
  std::vector<ScriptStep> path;      // changes to the camera path
  std::optional<int> exchange_key;   // key to swap the selected one with
  std::optional<bool> play;          // the path; false: it stops
  std::optional<double> scrub_s;
  RecordWish record = RecordWish::kNone;
  bool export_page = false;
};

// Names of the panel's groups, as scripts open and close them.
const std::vector<std::string>& PanelGroups();

// Between Window::BeginUi and EndUi.
PanelWishes DrawPanel(const PanelFacts& facts, ViewerSettings& settings);
// A line at the bottom, where there is one.
void DrawMessage(const std::string& message);
// While the scene is opened; fraction < 0: unknown.
void DrawOpening(const std::string& scene, const std::string& task, double fraction);
// A ring around the point that an orbit turns about, or around a mark.
void DrawPivot(double x_px, double y_px, double pixel_density);
// Between two marks.
void DrawLine(const Eigen::Vector2d& a_px, const Eigen::Vector2d& b_px);
// "1.2 units", or metres where the scene has a scale.
std::string LengthText(double units, const std::optional<double>& metres_per_unit);

}  // namespace lumi
