#include "render/path/camera_path.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "capture.h"
#include "render/path/nerfstudio_path.h"
#include "render/path/path_editing.h"
#include "render/path/path_frames.h"
#include "scene/geometry/angle.h"
#include "scene/model/orientation.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

struct TemporaryFile {
  std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("lumi-path-test-" + std::to_string(::getpid()) + ".json");
  ~TemporaryFile() { std::filesystem::remove(path); }
};

TEST(CameraPath, ComesBackFromItsFile) {
  const test::Capture c = test::MakeCapture(6, 16);
  const CameraPath path = PathThroughPhotos(c.scene, 4, 25);
  TemporaryFile file;
  WriteCameraPath(file.path, path);
  const CameraPath back = ReadCameraPath(file.path);
  ASSERT_EQ(back.keys.size(), path.keys.size());
  EXPECT_EQ(back.fps, 25);
  for (std::size_t i = 0; i < path.keys.size(); ++i) {
    EXPECT_LT((back.keys[i].cam_from_world.OriginInSource() - path.keys[i].cam_from_world.OriginInSource()).norm(),
              1e-12);
    EXPECT_NEAR(back.keys[i].time_s, path.keys[i].time_s, 1e-12);
  }
}

// A path that has a size keeps its shape at any other; one without is as the photos are.
TEST(CameraPath, KeepsItsShapeAtAnotherSize) {
  const test::Capture c = test::MakeCapture(6, 16);  // photos of 160 x 120
  CameraPath path = PathThroughPhotos(c.scene, 4, 25);
  const auto size = [&](int width, int height) { return FramesOfPath(c.scene, path, width, height).front().size_px; };
  path.width_px = path.height_px = 0;
  EXPECT_EQ(size(320, 0), Eigen::Vector2i(320, 240));
  EXPECT_EQ(size(0, 240), Eigen::Vector2i(320, 240));
  path.width_px = 1920, path.height_px = 1080;
  EXPECT_EQ(size(0, 0), Eigen::Vector2i(1920, 1080));
  EXPECT_EQ(size(640, 0), Eigen::Vector2i(640, 360));
  EXPECT_EQ(size(0, 540), Eigen::Vector2i(960, 540));
  EXPECT_EQ(size(100, 100), Eigen::Vector2i(100, 100));
}

// Cropped photos, and those of a lens that is shifted: where the axis meets the picture is part of what a view is.
TEST(CameraPath, KeepsThePrincipalPoint) {
  test::Capture c = test::MakeCapture(6, 16);
  const Camera shifted = Camera::Pinhole(160, 120, 150, 150, 64, 72);
  c.scene.cameras[0] = shifted;
  const CameraPath path = PathThroughPhotos(c.scene, 4, 25);
  TemporaryFile file;
  WriteCameraPath(file.path, path);
  const CameraPath back = ReadCameraPath(file.path);
  for (const PathKey& key : back.keys) EXPECT_LT((key.principal_point - Eigen::Vector2d(0.4, 0.6)).norm(), 1e-12);
  // Between keys, too, and at another size.
  const RenderView at = MakeRenderView(PoseOnPath(back, 1.3), 320, 240);
  const Eigen::Vector3d ahead = PoseOnPath(back, 1.3).cam_from_world.Inverse() * Eigen::Vector3d(0, 0, 2);
  EXPECT_LT(((at.P * ahead.homogeneous()).hnormalized() - Eigen::Vector2d(128, 144)).norm(), 1e-9);
  // A photo alone is its own path.
  c.scene.views.resize(1);
  const RenderView photo = MakeRenderView(c.scene, c.scene.views[0]);
  const RenderView one = SamplePath(PathThroughPhotos(c.scene, 4, 25), 160, 120).front();
  EXPECT_LT((photo.P / photo.P.row(2).norm() - one.P / one.P.row(2).norm()).norm(), 1e-9);
}

TEST(CameraPath, GoesThroughItsKeysWithoutJumps) {
  CameraPath path;
  path.fps = 50;
  for (int i = 0; i < 5; ++i)
    path.keys.push_back(
        {LookAt({std::cos(i * 0.4) * 3, std::sin(i * 0.4) * 3, 1}, {0, 0, 0}, {0, 0, 1}), 0.8, i * i * 0.25});
  const auto views = SamplePath(path, 64, 48);
  ASSERT_EQ(views.size(), 200u);
  EXPECT_LT((views.front().centre - path.keys.front().cam_from_world.OriginInSource()).norm(), 1e-9);
  EXPECT_LT((views.back().centre - path.keys.back().cam_from_world.OriginInSource()).norm(), 1e-9);
  double longest = 0;
  for (std::size_t i = 1; i < views.size(); ++i)
    longest = std::max(longest, (views[i].centre - views[i - 1].centre).norm());
  // The fastest stretch goes 1.2 units in 0.25 s: 0.096 a frame on the mean, not twice that anywhere.
  EXPECT_LT(longest, 0.19);
}

TEST(CameraPath, StraightAndEvenKeysGiveAStraightEvenPath) {
  CameraPath path;
  path.fps = 10;
  for (int i = 0; i < 4; ++i)
    path.keys.push_back({Rigid3{Eigen::Quaterniond::Identity(), {-1.0 * i, 0, 0}}, 0.8, 1.0 * i});
  const auto views = SamplePath(path, 64, 48);
  for (std::size_t i = 0; i < views.size(); ++i)
    EXPECT_LT(
        (views[i].centre - Eigen::Vector3d(3.0 * static_cast<double>(i) / static_cast<double>(views.size() - 1), 0, 0))
            .norm(),
        1e-9);
}

TEST(CameraPath, ThroughAScenesPhotosStaysNearThem) {
  const test::Capture c = test::MakeCapture(12, 16);
  for (const RenderView& v : SamplePath(PathThroughPhotos(c.scene, 3, 30), 32, 24)) {
    double nearest = 1e9;
    for (const View& view : c.scene.views) nearest = std::min(nearest, (view.CentreInWorld() - v.centre).norm());
    EXPECT_LT(nearest, 1.0);
  }
}

// Half the photos held upright: the film through them does not roll from one to the next.
TEST(CameraPath, PortraitPhotosAreVisitedUpright) {
  test::Capture c = test::MakeCapture(12, 64);
  const CameraPath before = PathThroughPhotos(c.scene, 3, 30);
  for (std::size_t i = 0; i < c.scene.views.size(); i += 2) {
    View& view = c.scene.views[i];
    view.cam_from_world = StoredPose(view.cam_from_world, 6);
    view.orientation = 6;
  }
  const Eigen::Vector2i stored = SizePx(c.scene, c.scene.views[0]);
  ASSERT_GT(stored.x(), stored.y());
  EXPECT_EQ(FilmSize(c.scene), stored);  // as many of one kind as of the other: wide
  const CameraPath mixed = PathThroughPhotos(c.scene, 3, 30);
  ASSERT_EQ(mixed.keys.size(), before.keys.size());
  for (std::size_t i = 0; i < mixed.keys.size(); ++i) {
    EXPECT_LT(mixed.keys[i].cam_from_world.rotation.angularDistance(before.keys[i].cam_from_world.rotation), 1e-6);
    EXPECT_NEAR(mixed.keys[i].vertical_fov_rad, before.keys[i].vertical_fov_rad, 1e-9);
  }
  // All of them: a film higher than wide, which shows what they show.
  for (std::size_t i = 1; i < c.scene.views.size(); i += 2) {
    View& view = c.scene.views[i];
    view.cam_from_world = StoredPose(view.cam_from_world, 8);
    view.orientation = 8;
  }
  EXPECT_EQ(FilmSize(c.scene), Eigen::Vector2i(stored.y(), stored.x()));
  const Camera& camera = c.scene.CameraOf(c.scene.views[0]);
  EXPECT_NEAR(PathThroughPhotos(c.scene, 3, 30).keys[0].vertical_fov_rad,
              2 * std::atan(0.5 * camera.width_px / camera.FocalPx().x()), 1e-9);
}

TEST(CameraPath, ASinglePhotoAndNoneAreHandled) {
  const test::Capture c = test::MakeCapture(1, 16);
  EXPECT_EQ(SamplePath(PathThroughPhotos(c.scene, 3, 30), 32, 24).size(), 1u);
  EXPECT_THROW(PathThroughPhotos(Scene{}, 3, 30), DataError);
}

TEST(CameraPath, BadFilesAreRefusedWithTheirReason) {
  TemporaryFile file;
  const auto write = [&](const std::string& text) { std::ofstream(file.path) << text; };
  const std::string key =
      R"({"time_s": 0, "position": [0,0,0], "cam_from_world_xyzw": [0,0,0,1], "vertical_fov_deg": 40})";
  write(R"({"format": "lumigraph-path", "version": 1, "keys": [)" + key + "]}");
  EXPECT_NO_THROW(ReadCameraPath(file.path));
  for (const std::string& text :
       {std::string("{"), std::string("[]"), std::string(R"({"format": "other"})"),
        R"({"format": "lumigraph-path", "version": 9, "keys": [)" + key + "]}",
        std::string(R"({"format": "lumigraph-path", "version": 1, "keys": []})"),
        R"({"format": "lumigraph-path", "version": 1, "keys": [)" + key + "," + key + "]}",  // times do not ascend
        R"({"format": "lumigraph-path", "version": 1, "fps": 0, "keys": [)" + key + "]}"}) {
    write(text);
    EXPECT_THROW(ReadCameraPath(file.path), InputError) << text;
  }
}

CameraPath Arc(int keys) {
  CameraPath path;
  path.fps = 24;
  for (int i = 0; i < keys; ++i)
    path.keys.push_back({LookAt({std::cos(i * 0.4) * 3, std::sin(i * 0.4) * 3, 1 + 0.2 * i}, {0.1, 0, 0.3}, {0, 0, 1}),
                         0.7 + 0.05 * i, 0.5 * i * (i + 1)});
  return path;
}

double Apart(const PathKey& a, const PathKey& b) {
  return (a.cam_from_world.OriginInSource() - b.cam_from_world.OriginInSource()).norm() +
         a.cam_from_world.rotation.angularDistance(b.cam_from_world.rotation) +
         std::abs(a.vertical_fov_rad - b.vertical_fov_rad);
}

TEST(CameraPath, APoseOnThePathIsItsKeyAtTheKeysTime) {
  const CameraPath path = Arc(5);
  for (const PathKey& key : path.keys) EXPECT_LT(Apart(PoseOnPath(path, key.time_s), key), 1e-7);
  EXPECT_LT(Apart(PoseOnPath(path, -7), path.keys.front()), 1e-7);
  EXPECT_LT(Apart(PoseOnPath(path, 1e9), path.keys.back()), 1e-7);
  EXPECT_THROW(PoseOnPath(CameraPath{}, 0), std::invalid_argument);
}

constexpr double kSameCamera = 1e-7;  // a quaternion's way through a matrix and back

TEST(NerfstudioPath, KeyframesAndFramesComeBack) {
  const CameraPath path = Arc(4);
  TemporaryFile file;
  WriteNerfstudioPath(file.path, path, 640, 360);
  const CameraPath keys = ReadCameraPath(file.path, PathDetail::kKeyframes);
  ASSERT_EQ(keys.keys.size(), 4u);
  EXPECT_EQ(keys.width_px, 640);
  EXPECT_EQ(keys.height_px, 360);
  EXPECT_NEAR(keys.fps, 24, 1e-12);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_LT(Apart(keys.keys[i], path.keys[i]), kSameCamera);
    EXPECT_NEAR(keys.keys[i].time_s, path.keys[i].time_s, 1e-12);
  }
  // What a renderer reads is every frame as it was sampled, no more and no less.
  const CameraPath frames = ReadCameraPath(file.path);
  const auto wanted = SamplePath(path, 640, 360), got = SamplePath(frames, 640, 360);
  ASSERT_EQ(got.size(), wanted.size());
  for (std::size_t i = 0; i < got.size(); ++i) {
    EXPECT_LT((got[i].centre - wanted[i].centre).norm(), kSameCamera);
    EXPECT_LT((got[i].P - wanted[i].P).norm(), 1e-6 * wanted[i].P.norm());
  }
}

TEST(NerfstudioPath, ItsCameraLooksAlongMinusZWithYUp) {
  TemporaryFile file;
  // At (1, 2, 3), unturned: it looks along -z of the world, the image's top is +y.
  std::ofstream(file.path)
      << R"({"camera_type": "perspective", "render_height": 100, "render_width": 200, "fps": 10, "seconds": 0.2,
    "camera_path": [{"camera_to_world": [1,0,0,1, 0,1,0,2, 0,0,1,3, 0,0,0,1], "fov": 90, "aspect": 2},
                    {"camera_to_world": [[1,0,0,1], [0,1,0,2], [0,0,1,4], [0,0,0,1]], "fov": 90, "aspect": 2}]})";
  const CameraPath path = ReadCameraPath(file.path);
  ASSERT_EQ(path.keys.size(), 2u);
  const auto views = SamplePath(path, path.width_px, path.height_px);
  ASSERT_EQ(views.size(), 2u);
  EXPECT_LT((views[0].centre - Eigen::Vector3d(1, 2, 3)).norm(), 1e-12);
  const auto ahead = Project(views[0].P, Eigen::Vector3d(1, 2, -7)),
             above = Project(views[0].P, Eigen::Vector3d(1, 12, -7));
  ASSERT_TRUE(ahead && above);
  EXPECT_LT((*ahead - Eigen::Vector2d(100, 50)).norm(), 1e-9);
  EXPECT_LT((*above - Eigen::Vector2d(100, 0)).norm(), 1e-9);  // half of 90 degrees up: the top row
  EXPECT_FALSE(Project(views[0].P, Eigen::Vector3d(1, 2, 8)));
}

TEST(NerfstudioPath, BadFilesAreRefusedInOneLineThatNamesThem) {
  TemporaryFile file;
  const std::string head =
      R"({"camera_type": "perspective", "render_height": 100, "render_width": 200, "fps": 10, "camera_path": )";
  const auto frame = [](const std::string& matrix, const std::string& fov) {
    return R"([{"camera_to_world": )" + matrix + R"(, "fov": )" + fov + "}]}";
  };
  const std::string unit = "[1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]";
  std::ofstream(file.path) << head + frame(unit, "50");
  EXPECT_NO_THROW(ReadCameraPath(file.path));
  for (const std::string& text :
       {head + "[]}", head + "7}", head + "[7]}", head + frame("[1,2,3]", "50"),
        head + frame("[1,0,0,0, 0,1,0,0, 0,0,-1,0, 0,0,0,1]", "50"),
        head + frame("[2,0,0,0, 0,2,0,0, 0,0,2,0, 0,0,0,1]", "50"),
        head + frame("[1,0,0,0, 0,1,0,0, 0,0,1,0, 5,6,7,1]", "50"), head + frame("\"text\"", "50"),
        head + frame(unit, "0"), head + frame(unit, "180"), head + frame(unit, "null"),
        R"({"camera_type": "equirectangular", "render_height": 100, "render_width": 200, "fps": 10, "camera_path": )" +
            frame(unit, "50"),
        R"({"render_height": -1, "render_width": 200, "camera_path": )" + frame(unit, "50"),
        R"({"render_height": 100, "render_width": 200, "seconds": 1e-9, "camera_path": )" + frame(unit, "50"),
        R"({"render_width": 200, "camera_path": )" + frame(unit, "50")}) {
    std::ofstream(file.path) << text;
    try {
      ReadCameraPath(file.path);
      ADD_FAILURE() << text << " was accepted";
    } catch (const InputError& e) {
      EXPECT_EQ(e.file(), file.path);
      EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << e.what();
    }
  }
}

// Damage anywhere is an InputError or a path in order, never anything else.
TEST(CameraPath, NoDamageToAFileGetsThroughUnnoticed) {
  TemporaryFile file;
  CameraPath path = Arc(3);
  path.fps = 2;
  for (const bool nerfstudio : {false, true}) {
    if (nerfstudio)
      WriteNerfstudioPath(file.path, path, 64, 48);
    else
      WriteCameraPath(file.path, path);
    std::ifstream in(file.path);
    const std::string whole((std::istreambuf_iterator<char>(in)), {});
    std::uint64_t state = 7;
    const auto random = [&](std::size_t n) {
      state = state * 6364136223846793005u + 1442695040888963407u;
      return static_cast<std::size_t>(state >> 33) % n;
    };
    int refused = 0;
    for (int round = 0; round < 400; ++round) {
      std::string text = whole;
      const std::size_t at = random(text.size());
      if (round % 3 == 0)
        text.resize(at);
      else if (round % 3 == 1)
        text[at] = "0-9e.\"[]{},x"[random(12)];
      else
        text.erase(at, 1 + random(12));
      std::ofstream(file.path, std::ios::trunc) << text;
      for (const PathDetail detail : {PathDetail::kFrames, PathDetail::kKeyframes}) {
        try {
          const CameraPath got = ReadCameraPath(file.path, detail);
          EXPECT_FALSE(got.keys.empty());
          for (std::size_t i = 1; i < got.keys.size(); ++i) EXPECT_GT(got.keys[i].time_s, got.keys[i - 1].time_s);
        } catch (const InputError&) {
          ++refused;
        }
      }
    }
    EXPECT_GT(refused, 400);  // half of 800: what is left are other digits
  }
}

TEST(PathEditing, KeysStayInOrderWhateverIsAskedFor) {
  CameraPath path = Arc(4);  // at 0, 1, 3, 6 s
  PathKey key = path.keys[2];
  key.time_s = 1;
  EXPECT_EQ(InsertKey(path, key), 2u);  // after the one that stands there
  EXPECT_GT(path.keys[2].time_s, path.keys[1].time_s);
  EXPECT_EQ(RetimeKey(path, 0, 4.5), 3u);
  EXPECT_LT(Apart(path.keys[3], Arc(4).keys[0]), 1e-12);
  DeleteKey(path, 3);
  ReplaceKey(path, 0, key);
  EXPECT_EQ(path.keys[0].time_s, 1);
  EXPECT_LT(Apart(path.keys[0], key), 1e-12);
  StretchTo(path, 2);
  EXPECT_NEAR(Duration(path), 2, 2 * kLeastGap_s);
  for (std::size_t i = 1; i < path.keys.size(); ++i)
    EXPECT_GE(path.keys[i].time_s, path.keys[i - 1].time_s + kLeastGap_s * (1 - 1e-9));
  EXPECT_THROW(DeleteKey(path, 99), std::out_of_range);
}

}  // namespace
}  // namespace lumi
