// The page where floats are short of digits and geometry is degenerate: scenes far from the origin, tiny and huge ones,
// views at a photo's own camera, with epipoles in the picture, and along the planes of faces.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <map>

#include "scene/files/mesh_io.h"
#include "scene/files/scene_folder.h"
#include "tests/support/simulated_capture.h"
#include "tests/support/web_page.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;

constexpr double kEdge = 0.005;  // of the pixels: at silhouettes a rasteriser and a tracer may disagree
// Where faces are seen along their plane more pixels are silhouettes.
constexpr double kManyEdges = 0.02;
constexpr int kPhotos = 6, kWidth = 240, kHeight = 180;

const SimulatedCapture& Capture(const std::string& example) {
  static std::map<std::string, std::unique_ptr<SimulatedCapture>> made;
  auto& capture = made[example];
  if (!capture) capture = std::make_unique<SimulatedCapture>(example, kPhotos, kWidth);
  return *capture;
}

struct Placed {
  const char* name;
  double scale;
  Eigen::Vector3d offset;  // in sizes of the scene
};
// The capture with its world moved: its own folder.
fs::path Moved(const SimulatedCapture& capture, const Placed& to) {
  const fs::path folder = capture / to.name;
  if (fs::exists(folder)) return folder;
  fs::copy(capture.path(), folder, fs::copy_options::recursive);
  Scene scene = OpenScene(folder, {}, SilentProgress());
  const Similarity3 move{to.scale, Eigen::Quaterniond(Eigen::AngleAxisd(1, Eigen::Vector3d(1, 2, 3).normalized())),
                         to.offset * to.scale / scene.normalized_from_world.scale};
  Mesh mesh = ReadMesh(ProxyPath(folder, scene.active_proxy));
  for (Eigen::Vector3d& v : mesh.vertices) v = move * v;
  WriteMesh(ProxyPath(folder, scene.active_proxy), mesh);
  Transform(scene, move);
  WriteScene(scene, folder);
  return folder;
}

// A scene's page in the browser, and the page's data as lumi-render draws it.
class Shown {
 public:
  explicit Shown(const fs::path& scene) {
    const std::string page = scene.string() + ".html", data = scene.string() + "-data";
    const ProgramResult made =
        RunProgram({"lumi-export", "web", scene.string(), "-o", page, "--as-scene", data, "--quiet"});
    if (made.exit_code != 0) throw std::runtime_error("lumi-export failed: " + made.err);
    browser().Open("about:blank");
    browser().Open("file://" + page);
    if (!browser().WaitFor("window.lumigraph && lumigraph.photos.finished"))
      throw std::runtime_error("the page did not come up");
    beside_ = std::make_unique<SceneBeside>(data, PageSettings(browser()));
  }
  const Scene& scene() const { return beside_->scene(); }
  std::string Picture(const RenderView& view) {
    return PagePicture(browser(), ViewForPage(view, scene().normalized_from_world));
  }
  void ExpectSame(const RenderView& view, const std::string& what, double edge = kEdge) {
    const Agreement agreement = Compare(beside_->Render(view), Picture(view));
    EXPECT_GE(agreement.psnr_db, kSamePictureDb) << what;
    EXPECT_LE(agreement.differ, edge) << what;
  }

 private:
  static Chromium& browser() {
    static Chromium browser(480, 360);
    return browser;
  }
  std::unique_ptr<SceneBeside> beside_;
};

RenderView Looking(const RenderView& like, const Rigid3& cam_from_world) {
  Camera camera;
  camera.width_px = like.size_px.x();
  camera.height_px = like.size_px.y();
  const double focal_px = 0.9 * like.size_px.x();
  camera.params = {focal_px, focal_px, 0.5 * camera.width_px, 0.5 * camera.height_px};
  return MakeRenderView(camera, cam_from_world);
}

class WebPageHardCase : public testing::TestWithParam<Placed> {};

TEST_P(WebPageHardCase, ASceneAnywhereOfAnySizeIsShownAsTheRendererShowsIt) {
  SKIP_WITHOUT_BROWSER();
  Shown shown(Moved(Capture("desk"), GetParam()));
  // At the photos' own cameras, where angles to a photo are zero, and between.
  const std::vector<RenderView> own = PhotosViews(shown.scene(), kPhotos);
  for (std::size_t i = 0; i < own.size(); ++i) shown.ExpectSame(own[i], "photo " + std::to_string(i));
  for (const RenderView& view : ViewsBetween(shown.scene(), 2, {kWidth, kHeight})) shown.ExpectSame(view, "between");
}

INSTANTIATE_TEST_SUITE_P(Placed, WebPageHardCase,
                         testing::Values(Placed{"far", 1, {3e5, -2e5, 1e5}}, Placed{"tiny", 1e-6, {0, 0, 0}},
                                         Placed{"huge", 1e6, {0, 0, 0}},
                                         Placed{"tiny-and-far", 1e-6, {1e4, 1e4, -1e4}}),
                         [](const auto& info) {
                           std::string name = info.param.name;
                           std::erase(name, '-');
                           return name;
                         });

TEST(WebPageHardCase, EpipolesInThePicture) {
  SKIP_WITHOUT_BROWSER();
  // A walk: photos stand before and behind each other. From behind and from before each, looking along it.
  Shown shown(Moved(Capture("hallway"), {"here", 1, {0, 0, 0}}));
  const Scene& scene = shown.scene();
  for (std::size_t i = 1; i + 1 < scene.views.size(); ++i) {
    const Rigid3 pose = scene.views[i].cam_from_world;
    const double step = (pose.OriginInSource() - scene.views[i - 1].cam_from_world.OriginInSource()).norm();
    const RenderView own = MakeRenderView(scene, scene.views[i]);
    for (const double back : {0.5, 1e-3, -0.3}) {
      Rigid3 moved = pose;
      moved.translation.z() += back * step;
      const RenderView view = Looking(own, moved);
      if (back > 0) {
        const Eigen::Vector3d epipole = view.P.leftCols<3>() * own.centre + view.P.col(3);
        ASSERT_NEAR(epipole.x() / epipole.z(), 0.5 * kWidth, 1);
      }
      shown.ExpectSame(view, "photo " + std::to_string(i) + ", " + std::to_string(back) + " steps behind");
    }
  }
}

TEST(WebPageHardCase, FacesSeenAlongTheirPlane) {
  SKIP_WITHOUT_BROWSER();
  const fs::path folder = Moved(Capture("desk"), {"here", 1, {0, 0, 0}});
  Shown shown(folder);
  const Mesh mesh = ReadMesh(ProxyPath(folder, shown.scene().active_proxy));
  const auto corner = [&](const auto& face, std::size_t i) -> const Eigen::Vector3d& {
    return mesh.vertices[static_cast<std::size_t>(face[i])];
  };
  const auto largest = std::ranges::max_element(mesh.faces, {}, [&](const auto& f) {
    return (corner(f, 1) - corner(f, 0)).cross(corner(f, 2) - corner(f, 0)).norm();
  });
  const Eigen::Vector3d a = corner(*largest, 0),
                        normal = (corner(*largest, 1) - a).cross(corner(*largest, 2) - a).normalized(),
                        middle = (a + corner(*largest, 1) + corner(*largest, 2)) / 3;
  for (std::size_t i = 0; i < shown.scene().views.size(); i += 2) {
    const RenderView own = MakeRenderView(shown.scene(), shown.scene().views[i]);
    const double above = normal.dot(own.centre - a);
    // In the plane, and a millionth of the distance beside it.
    for (const double lift : {0.0, 1e-6, -1e-6}) {
      const Eigen::Vector3d eye = own.centre - (1 - lift) * above * normal;
      shown.ExpectSame(Looking(own, LookAt(eye, middle, shown.scene().up)),
                       "photo " + std::to_string(i) + ", lifted by " + std::to_string(lift), kManyEdges);
    }
  }
}

}  // namespace
}  // namespace lumi
