// What the tests of scene/files share: folders that vanish, small scenes and pictures, errors and their kinds.
#pragma once

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>
#include <string>

#include "scene/files/image_io.h"
#include "scene/model/scene.h"
#include "scene/program/error.h"

namespace lumi::test {

namespace fs = std::filesystem;

class TempFolder {
 public:
  TempFolder() {
    static std::atomic<int> counter{0};
    path_ = fs::temp_directory_path() / ("lumi-files-" + std::to_string(::getpid()) + "-" + std::to_string(counter++));
    fs::create_directories(path_);
  }
  ~TempFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  TempFolder(const TempFolder&) = delete;
  TempFolder& operator=(const TempFolder&) = delete;
  const fs::path& path() const { return path_; }
  fs::path operator/(const std::string& name) const { return path_ / name; }

 private:
  fs::path path_;
};

inline void Write(const fs::path& path, const std::string& bytes) {
  fs::create_directories(path.parent_path());
  fs::remove(path);  // writing over a file makes ext4 flush it: milliseconds each, thousands of times here
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}
inline std::string Read(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream all;
  all << in.rdbuf();
  return all.str();
}
inline std::size_t CountFiles(const fs::path& folder) {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

// The error that `body` throws: its exit code, message and hint in one text; fails the test where none comes.
struct Caught {
  ExitCode code = ExitCode::kDone;
  std::string text;
};
template <typename Body>
Caught Catch(Body&& body) {
  try {
    body();
  } catch (const Error& e) {
    return {e.code(), e.file().string() + ": " + e.what() + " (" + e.hint() + ")"};
  }
  return {};
}
#define EXPECT_REFUSED(expected_code, expected_text, ...)                         \
  do {                                                                            \
    const auto caught = ::lumi::test::Catch([&] { __VA_ARGS__; });                \
    EXPECT_EQ(caught.code, expected_code) << caught.text;                         \
    EXPECT_NE(caught.text.find(expected_text), std::string::npos) << caught.text; \
    EXPECT_EQ(caught.text.find('\n'), std::string::npos) << "more than one line"; \
  } while (false)

// While it lives, no file of this process (or a child) grows beyond `bytes`: what a full disk does, for any user.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) : old_handler_(::signal(SIGXFSZ, SIG_IGN)) {
    ::getrlimit(RLIMIT_FSIZE, &old_);
    rlimit limit = old_;
    limit.rlim_cur = bytes;
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    ::setrlimit(RLIMIT_FSIZE, &old_);
    ::signal(SIGXFSZ, old_handler_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit old_{};
  void (*old_handler_)(int);
};

inline fs::path SharedData(const std::string& name) {
  return fs::path(LUMI_SOURCE_DIR) / ".." / "shared" / "data" / name;
}

// Smooth colours with some detail: survives JPEG well.
inline Image8 ColorfulImage(int width, int height) {
  Image8 image(width, height, 3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      image.At(x, y, 0) = static_cast<std::uint8_t>(255 * x / width);
      image.At(x, y, 1) = static_cast<std::uint8_t>(255 * y / height);
      image.At(x, y, 2) = static_cast<std::uint8_t>(127.5 + 100 * std::sin(0.2 * x) * std::cos(0.15 * y));
    }
  return image;
}

// Four views on an arc, two cameras, `points` points with exact observations in the views that see them.
inline Scene SmallScene(int points, CameraModel second = CameraModel::kPinhole) {
  Scene scene;
  scene.cameras.push_back(Camera::Pinhole(64, 48, 60, 61, 31.5, 24.25));
  Camera other{second, 64, 48, {}};
  switch (second) {
    case CameraModel::kSimplePinhole: other.params = {60, 32, 24}; break;
    case CameraModel::kPinhole: other.params = {60, 62, 32, 24}; break;
    case CameraModel::kSimpleRadial: other.params = {60, 32, 24, -0.05}; break;
    case CameraModel::kRadial: other.params = {60, 32, 24, -0.05, 0.01}; break;
    case CameraModel::kOpenCV: other.params = {60, 62, 32, 24, -0.05, 0.01, 1e-3, -2e-3}; break;
    case CameraModel::kOpenCVFisheye: other.params = {40, 41, 32, 24, 0.01, -0.002, 0.001, -1e-4}; break;
    case CameraModel::kPlumbBob: break;  // of camera.yaml alone: no scene's camera
  }
  scene.cameras.push_back(other);
  const char* names[] = {"a one.jpg", "b/two.jpg", "c.jpg", "d.jpg"};
  for (int i = 0; i < 4; ++i) {
    View view;
    view.name = names[i];
    view.camera = {i % 2};
    view.cam_from_world = LookAt({std::sin(0.2 * i - 0.3) * 4, 0.3 * i, -4}, {0, 0, 0}, -Eigen::Vector3d::UnitY());
    scene.views.push_back(view);
  }
  std::mt19937 random(7);
  std::uniform_real_distribution<double> in_box(-1, 1);
  for (int i = 0; i < points; ++i) {
    Point point;
    point.x_in_world = {in_box(random), in_box(random), in_box(random)};
    point.color = {static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(2 * i), 77};
    point.error_px = 0.25 + i;
    for (int v = 0; v < 4; ++v) {
      const View& view = scene.views[static_cast<std::size_t>(v)];
      const auto x = scene.CameraOf(view).Project(view.cam_from_world * point.x_in_world);
      if (x && (i + v) % 5 != 0) point.track.push_back({{v}, *x});
    }
    scene.points.push_back(point);
  }
  UpdateFrameOfReference(scene);
  return scene;
}

inline void ExpectSame(const Scene& a, const Scene& b, double tolerance) {
  ASSERT_EQ(a.cameras.size(), b.cameras.size());
  ASSERT_EQ(a.views.size(), b.views.size());
  ASSERT_EQ(a.points.size(), b.points.size());
  for (std::size_t i = 0; i < a.cameras.size(); ++i) {
    EXPECT_EQ(a.cameras[i].model, b.cameras[i].model);
    EXPECT_EQ(a.cameras[i].width_px, b.cameras[i].width_px);
    EXPECT_EQ(a.cameras[i].height_px, b.cameras[i].height_px);
    EXPECT_EQ(a.cameras[i].params, b.cameras[i].params);
  }
  for (std::size_t i = 0; i < a.views.size(); ++i) {
    EXPECT_EQ(a.views[i].name, b.views[i].name);
    EXPECT_EQ(a.views[i].camera, b.views[i].camera);
    EXPECT_LE((a.views[i].cam_from_world.Matrix() - b.views[i].cam_from_world.Matrix()).norm(), tolerance);
  }
  for (std::size_t i = 0; i < a.points.size(); ++i) {
    EXPECT_EQ(a.points[i].x_in_world, b.points[i].x_in_world);
    EXPECT_EQ(a.points[i].color, b.points[i].color);
    EXPECT_EQ(a.points[i].error_px, b.points[i].error_px);
    ASSERT_EQ(a.points[i].track.size(), b.points[i].track.size());
    for (std::size_t k = 0; k < a.points[i].track.size(); ++k) {
      EXPECT_EQ(a.points[i].track[k].view, b.points[i].track[k].view);
      EXPECT_EQ(a.points[i].track[k].x_px, b.points[i].track[k].x_px);
    }
  }
}

}  // namespace lumi::test
