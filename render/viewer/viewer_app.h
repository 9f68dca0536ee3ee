// The viewer between its window and its picture: one object a run. viewer.cc draws and steers, viewer_script.cc runs
// scripts.
#pragma once

#include <algorithm>
#include <chrono>
#include <deque>
#include <filesystem>
#include <future>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "render/gl/gl_lumigraph.h"
#include "render/viewer/frame_painter.h"
#include "render/viewer/navigation.h"
#include "render/viewer/opening.h"
#include "render/viewer/overlay.h"
#include "render/viewer/panel.h"
#include "render/viewer/photo_loader.h"
#include "render/viewer/script.h"
#include "render/viewer/viewer.h"
#include "render/viewer/window.h"
#include "scene/files/scene_folder.h"
#include "scene/program/parallel.h"

namespace lumi {

using Clock = std::chrono::steady_clock;
constexpr double kMb = 1e6;
constexpr double kMessage_s = 4.0;

inline double SecondsSince(Clock::time_point t) { return std::chrono::duration<double>(Clock::now() - t).count(); }

class Viewer {
 public:
  Viewer(const ViewerOptions& options, Window& window, Opened& opened, ProgressSink& progress, std::vector<ScriptStep> script)
      : options_(options),
        window_(window),
        scene_(opened.scene),
        progress_(progress),
        budget_(PlanPhotos(scene_, static_cast<std::size_t>(options.memory_mb) * static_cast<std::size_t>(kMb))),
        lumigraph_(scene_, budget_.sizes_px),
        painter_(lumigraph_, PainterOptions{}),
        home_(StateOfView(scene_, StartView())),
        navigator_(home_, scene_.up, 1.0 / scene_.normalized_from_world.scale),
        loader_(scene_, budget_.max_side_px, std::clamp(ThreadCount() - 1, 1, 6)),
        script_(script.begin(), script.end()),
        scripted_(!script.empty()) {
    settings_.radiance.k = options.k;
    settings_.panel = options.show_ui;
    loader_.SetFocus(home_.cam_from_world);
    SetProxy(opened.proxy, opened.proxy_name);
    for (const View& v : scene_.views) facts_.photo_names.push_back(v.name);
    facts_.scene = std::filesystem::absolute(options.scene).lexically_normal().filename().string();
    if (facts_.scene.empty()) facts_.scene = "lumigraph";
    facts_.device = GlDeviceName();
    facts_.photos_total = static_cast<int>(scene_.views.size());
    facts_.budget_mb = options.memory_mb;
    for (int side = budget_.max_side_px; 2 * side <= LargestSide(); side *= 2) ++facts_.halvings;
    facts_.proxies = ListProxies(scene_.folder);
  }

  nlohmann::json Run();

 private:
  ViewId StartView() const {
    return {options_.view.empty() ? static_cast<int>(scene_.views.size()) / 2 : FindView(scene_, options_.view)};
  }
  int LargestSide() const {
    int side = 1;
    for (const View& v : scene_.views) side = std::max({side, scene_.CameraOf(v).width_px, scene_.CameraOf(v).height_px});
    return side;
  }
  void SetProxy(const Mesh& mesh, const std::string& name) {
    lumigraph_.SetProxy(mesh);
    facts_.proxy = name;
    facts_.faces = static_cast<int>(mesh.faces.size());
    ++generation_;
  }
  void Say(const std::string& message) {
    facts_.message = message;
    message_until_ = Clock::now() + std::chrono::milliseconds(static_cast<int>(1000 * kMessage_s));
  }

  void TakePhotos();
  void TakeProxy();
  void WishProxy(const std::string& name);
  bool Steer(const WindowInput& input, double dt_s);
  void Key(int key);
  void Jump(int view, bool at_once);
  Eigen::Vector3d Pivot();
  std::optional<Eigen::Vector3d> PointAt(double x_px, double y_px) const;
  RenderRequest Request(const Eigen::Vector2i& size_px) const;
  void Compose();
  void Screenshot(const std::filesystem::path& file, bool with_ui);
  std::filesystem::path FreeScreenshotName() const;
  bool Loading() const { return loader_.outstanding() > 0 || new_photos_; }
  void RunScript();
  void AfterPainting();

  const ViewerOptions& options_;
  Window& window_;
  const Scene& scene_;
  ProgressSink& progress_;
  PhotoBudget budget_;
  GlLumigraph lumigraph_;
  FramePainter painter_;
  Overlay overlay_;
  ViewState home_;
  Navigator navigator_;
  PhotoLoader loader_;
  std::future<std::pair<std::string, Mesh>> proxy_loading_;
  ViewerSettings settings_;
  PanelFacts facts_;
  Clock::time_point message_until_ = Clock::now();

  std::optional<Eigen::Vector3d> pivot_;        // picked by the user
  std::optional<Eigen::Vector3d> drag_pivot_;   // of the drag that goes on
  int current_photo_ = -1;                      // jumped to last
  bool new_photos_ = false;
  Clock::time_point last_refresh_ = Clock::now() - std::chrono::hours(1);
  long generation_ = 0;                         // of photos and proxy

  Eigen::Vector2i size_px_ = {1, 1};
  std::optional<RenderRequest> drawn_;
  long drawn_generation_ = -1;

  std::deque<ScriptStep> script_;
  bool scripted_;
  Clock::time_point waiting_since_ = Clock::now();
  bool waiting_ = false;
  std::vector<std::string> screenshots_;
  std::vector<double> frame_ms_;
};

}  // namespace lumi
