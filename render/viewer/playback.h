// A lumigraph along a path of matrices: plays it, scrubs, shows false colours, the proxy of each picture, and the
// measures. A scene without a metric can only be seen along its path: it has no point to orbit and no unit of length to
// move by.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "render/viewer/opening.h"
#include "render/viewer/view_session.h"

namespace lumi {

class Playback final : public ViewSession {
 public:
  Playback(const ViewerOptions& options, Window& window, const Opened& opened, const std::vector<ScriptStep>& script);

 private:
  void Steer(const WindowInput& input, double dt_s) override;
  bool RunStatement(const ScriptStep& s) override;
  void Paint() override;
  void DrawPanels() override;
  void Compose() override;
  double Wait_s() const override;
  bool with_photos() const override { return !picture_.empty(); }
  bool AtRest() const override { return !playing_since_ && drawn_ == Wanted(); }
  bool ReadyForScreenshot() const override { return drawn_ == Wanted(); }
  bool panel() const override { return panel_; }
  void Summarise(JsonKeys& j) override;

  void Key(int key);
  void Go(int frame);
  void GoToPhoto(const std::string& name);  // throws UsageError
  void Play();
  void DrawPanel();
  ImageF Picture(const RenderRequest& request);
  // What is drawn: a picture of the path's aspect that fits the window.
  Eigen::Vector2i PictureSize() const;
  int last() const { return static_cast<int>(opened_.frames.size()) - 1; }

  const Opened& opened_;
  std::unique_ptr<Renderer> renderer_;
  PictureTexture picture_;
  RadianceSettings settings_;
  Seen seen_;
  bool fill_ = true;  // fill holes smoothly from around them; only in colour pictures
  bool panel_ = true;
  int frame_ = 0;
  std::optional<Clock::time_point> playing_since_;
  int playing_from_ = 0;
  long played_ = 0;  // frames that playing showed
  struct Drawn {
    int frame = -1;
    Eigen::Vector2i shown_px = Eigen::Vector2i::Zero();  // smaller than the window while the path plays
    Seen seen;
    RadianceSettings settings;
    bool fill = false;
    friend bool operator==(const Drawn&, const Drawn&) = default;
  } drawn_;
  Drawn Wanted() const { return {frame_, size_px_, seen_, settings_, fill_}; }
  double picture_ms_ = 0, playing_scale_ = 0.5;
  std::string problem_;  // why the settings are not what is shown
};

}  // namespace lumi
