// A page of lumi-export's in a browser, and the same views by lumi-render's library.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "render/lumigraph/lumigraph.h"
#include "tests/support/chromium.h"

namespace lumi {

// At the beginning of a test.
#define SKIP_WITHOUT_BROWSER() \
  if (!Chromium::IsThere()) GTEST_SKIP() << "no Chromium is installed (Debian's package chromium)"

// Over covered pixels: two decoders of JPEG, and weights in float.
inline constexpr double kSamePictureDb = 40;

// A page's data as a scene (lumi-export --as-scene), drawn by the CPU renderer with the effects that the page has on.
class SceneBeside {
 public:
  // Without a page's settings: the scene itself, with the effects that it calls for, as lumi-render draws it.
  explicit SceneBeside(const std::filesystem::path& scene);
  SceneBeside(const std::filesystem::path& scene, const nlohmann::json& page_settings, const std::string& proxy = "");
  const Scene& scene() const { return lumigraph_->scene(); }
  ImageF Render(const RenderView& view);

 private:
  std::unique_ptr<Lumigraph> lumigraph_;
  std::unique_ptr<Renderer> renderer_;
  std::optional<bool> exposure_;  // nothing: as the scene has it
};

// Cameras of so many photos, spread over all of them, and views between photos along the path through them.
std::vector<RenderView> PhotosViews(const Scene& scene, int count);
std::vector<RenderView> ViewsBetween(const Scene& scene, int count, const Eigen::Vector2i& size_px);

// A view as the page's picture(), pictureText() and time() take it. frame: the scene's that the page was made of.
nlohmann::json ViewForPage(const RenderView& view, const Similarity3& normalized_from_world);

// The page's effects and settings. Its whole manifest may hold tens of megabytes of photos.
nlohmann::json PageSettings(Chromium& browser);

// RGBA, rows from the top, when all photos that the page wants for the view are there.
std::string PagePicture(Chromium& browser, const nlohmann::json& view);

struct Agreement {
  double psnr_db = 0;  // over pixels that both cover
  double differ = 0;   // share of the pixels that one covers and the other does not
};
// Throws std::runtime_error where the page's picture is of another size.
Agreement Compare(const ImageF& ours, const std::string& page_rgba);

// Opens a page and waits until all photos that it wants are there. Throws std::runtime_error with the page's words.
void OpenPage(Chromium& browser, const std::string& url);

// A page's pictures at so many photos' cameras (none left out) and as many views between.
struct PageAgreement {
  Agreement worst;         // against lumi-render's over the page's own data
  double of_scene_db = 0;  // mean, against lumi-render's over the scene itself
  std::string worst_view;
};
// The browser is at the page; data: lumi-export's --as-scene. scene: empty, or what the page was made of.
PageAgreement AgreementOf(Chromium& browser, const std::filesystem::path& data, const std::filesystem::path& scene,
                          int photos, int between);

}  // namespace lumi
