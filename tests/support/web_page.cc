#include "tests/support/web_page.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "render/path/camera_path.h"
#include "scene/program/progress.h"

namespace lumi {

using nlohmann::json;

SceneBeside::SceneBeside(const std::filesystem::path& scene, const json& page_settings, const std::string& proxy) {
  ProgressSink& sink = SilentProgress();
  LumigraphOptions options;
  options.scene = scene;
  std::string effects;
  for (const json& effect : page_settings["effects"])
    // Photos are corrected already, and the scene has the gains that go with them: not estimated once more.
    if (effect["on"] == true && effect["name"] != "exposure" && effect["name"] != "white-balance" &&
        effect["name"] != "vignetting")
      effects += (effects.empty() ? "" : ",") + effect["name"].get<std::string>();
  exposure_ = page_settings["settings"]["exposure"];
  options.effects = effects.empty() ? "none" : effects;
  lumigraph_ = std::make_unique<Lumigraph>(options, sink);
  lumigraph_->MakePictures(proxy, false);
  lumigraph_->ReadPhotos(sink);
  renderer_ = lumigraph_->NewRenderer(MakeCpuRenderer);
}

SceneBeside::SceneBeside(const std::filesystem::path& scene) {
  ProgressSink& sink = SilentProgress();
  LumigraphOptions options;
  options.scene = scene;
  lumigraph_ = std::make_unique<Lumigraph>(options, sink);
  lumigraph_->MakePictures("", false);
  lumigraph_->ReadPhotos(sink);
  const Eigen::Vector2i film = FilmSize(lumigraph_->scene());
  lumigraph_->ChooseMeasures(SamplePath(PathThroughPhotos(lumigraph_->scene(), 1, 30), film.x(), film.y()), {});
  renderer_ = lumigraph_->NewRenderer(MakeCpuRenderer);
}

ImageF SceneBeside::Render(const RenderView& view) {
  RenderRequest request;
  request.view = view;
  request.settings = lumigraph_->At(view);
  if (view.time_s && request.settings.time) request.settings.time_s = *view.time_s;
  if (exposure_) request.settings.exposure = *exposure_;
  return renderer_->Render(request);
}

std::vector<RenderView> PhotosViews(const Scene& scene, int count) {
  const int all = static_cast<int>(scene.views.size()), n = std::min(count, all);
  std::vector<RenderView> views;
  for (int i = 0; i < n; ++i)
    views.push_back(MakeRenderView(scene, scene.views[static_cast<std::size_t>((2 * i + 1) * all / (2 * n))]));
  return views;
}

std::vector<RenderView> ViewsBetween(const Scene& scene, int count, const Eigen::Vector2i& size_px) {
  const CameraPath path = PathThroughPhotos(scene, 1, 30);
  std::vector<RenderView> views;
  for (int i = 0; i < count; ++i)
    views.push_back(MakeRenderView(PoseOnPath(path, Duration(path) * (i + 0.5) / count), size_px.x(), size_px.y()));
  return views;
}

json ViewForPage(const RenderView& view, const Similarity3& normalized_from_world) {
  const RenderView normalized = Normalized(view, normalized_from_world);
  Eigen::Matrix3d m = normalized.P.leftCols<3>();
  m /= m.row(2).norm();
  json rows = json::array();
  for (int i = 0; i < 9; ++i) rows.push_back(m(i / 3, i % 3));
  json j = {{"m", rows},
            {"centre", {normalized.centre.x(), normalized.centre.y(), normalized.centre.z()}},
            {"size", {normalized.size_px.x(), normalized.size_px.y()}}};
  if (view.time_s) j["time_s"] = *view.time_s;
  return j;
}

json PageSettings(Chromium& browser) {
  return browser.Evaluate("({ effects: lumigraph.manifest.effects, settings: lumigraph.manifest.settings })");
}

std::string PagePicture(Chromium& browser, const json& view) {
  return FromBase64(browser.Evaluate("lumigraph.pictureText(" + view.dump() + ")"));
}

Agreement Compare(const ImageF& ours, const std::string& page_rgba) {
  if (page_rgba.size() != static_cast<std::size_t>(4 * ours.width * ours.height))
    throw std::runtime_error("the page's picture has " + std::to_string(page_rgba.size()) + " bytes");
  double squares = 0, n = 0, odd = 0;
  for (int y = 0; y < ours.height; ++y)
    for (int x = 0; x < ours.width; ++x) {
      const auto at = static_cast<std::size_t>(4 * (y * ours.width + x));
      const auto value = [&](std::size_t c) {
        return static_cast<double>(static_cast<unsigned char>(page_rgba[at + c]));
      };
      const double alpha = ours.At(x, y, 3);
      odd += (alpha > 0.5) != (value(3) > 127);
      if (alpha < 0.5 || value(3) < 128) continue;
      for (int c = 0; c < 3; ++c) {
        const double d =
            255 * std::clamp(static_cast<double>(ours.At(x, y, c)), 0.0, 1.0) - value(static_cast<std::size_t>(c));
        squares += d * d;
        ++n;
      }
    }
  // Nothing that both cover agrees in nothing.
  return {n > 0 ? 10 * std::log10(255 * 255 * n / std::max(squares, 1e-9)) : 0, odd / (ours.width * ours.height)};
}

void OpenPage(Chromium& browser, const std::string& url) {
  browser.Open("about:blank");
  browser.Open(url);
  if (browser.WaitFor("window.lumigraph && lumigraph.photos.finished", 300)) return;
  const std::string said = browser.Evaluate("document.getElementById('message')?.textContent ?? ''");
  throw std::runtime_error(url + " did not come up: " + said +
                           (browser.errors().empty() ? "" : "; " + browser.errors().front()));
}

PageAgreement AgreementOf(Chromium& browser, const std::filesystem::path& data, const std::filesystem::path& scene,
                          int photos, int between) {
  SceneBeside beside(data, PageSettings(browser));
  const std::unique_ptr<SceneBeside> whole = scene.empty() ? nullptr : std::make_unique<SceneBeside>(scene);
  std::vector<RenderView> views = PhotosViews(beside.scene(), photos);
  const Eigen::Vector2i size = views.front().size_px;
  for (RenderView& view : ViewsBetween(beside.scene(), between, size)) views.push_back(view);
  PageAgreement out;
  out.worst.psnr_db = 1000;
  for (std::size_t i = 0; i < views.size(); ++i) {
    views[i].gain = 1;  // as bright as the scene, whichever photo it is
    const std::string picture = PagePicture(browser, ViewForPage(views[i], beside.scene().normalized_from_world));
    const Agreement own = Compare(beside.Render(views[i]), picture);
    if (own.psnr_db < out.worst.psnr_db) {
      out.worst.psnr_db = own.psnr_db;
      out.worst_view = i < views.size() - static_cast<std::size_t>(between)
                           ? "a photo's, " + std::to_string(i)
                           : "between, " + std::to_string(i + static_cast<std::size_t>(between) - views.size());
    }
    out.worst.differ = std::max(out.worst.differ, own.differ);
    if (whole) out.of_scene_db += Compare(whole->Render(views[i]), picture).psnr_db / static_cast<double>(views.size());
  }
  return out;
}

}  // namespace lumi
