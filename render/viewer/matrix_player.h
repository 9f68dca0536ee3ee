// The viewer on a path of matrices: plays it, scrubs, shows false colours, the proxy of each picture, and the measures. A scene without
// a metric is seen along its path only: there is nothing to turn about, and no step has a length.
#pragma once

#include <chrono>
#include <deque>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "render/effects/effects.h"
#include "render/path/matrix_path.h"
#include "render/viewer/overlay.h"
#include "render/viewer/picture_texture.h"
#include "render/viewer/script.h"
#include "render/viewer/seen.h"
#include "render/viewer/viewer.h"
#include "render/viewer/window.h"
#include "render/world/per_view_proxy.h"

namespace lumi {

class MatrixPlayer {
 public:
  MatrixPlayer(const ViewerOptions& options, Window& window, const Opened& opened, std::vector<ScriptStep> script);
  nlohmann::json Run();

 private:
  using Clock = std::chrono::steady_clock;
  void Steer(const WindowInput& input);
  void Go(int frame);
  void Play();
  void Paint();
  void DrawUi();
  void RunScript();
  void Screenshot(const std::string& file);
  void Say(const std::string& message);
  // What is drawn: a picture of the path's aspect that fits the window.
  Eigen::Vector2i PictureSize() const;

  Window& window_;
  const Opened& opened_;
  std::unique_ptr<Renderer> renderer_;
  Overlay overlay_;
  PictureTexture picture_;
  RadianceSettings settings_;
  Seen seen_;
  bool panel_ = true;
  int frame_ = 0;
  std::optional<Clock::time_point> playing_since_;
  int playing_from_ = 0;
  struct Drawn {
    int frame = -1;
    Eigen::Vector2i shown_px = Eigen::Vector2i::Zero();  // smaller than the window while the path plays
    Seen seen;
    RadianceSettings settings;
    friend bool operator==(const Drawn&, const Drawn&) = default;
  } drawn_;
  Drawn AtRest() const { return {frame_, window_.FramebufferSize().cwiseMax(1), seen_, settings_}; }
  double picture_ms_ = 0, playing_scale_ = 0.5;
  std::string message_, problem_;
  Clock::time_point message_until_ = Clock::now();
  std::deque<ScriptStep> script_;
  bool scripted_;
  bool waiting_ = false;
  Clock::time_point waiting_since_ = Clock::now();
  std::vector<std::string> screenshots_;
  std::vector<double> frame_ms_;
  long played_ = 0;                // frames that playing showed
};

}  // namespace lumi
