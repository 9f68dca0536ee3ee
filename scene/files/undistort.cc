// Photos resampled to pinhole cameras (see scene_folder.h). The new camera keeps the size of the photo; one factor on
// both focal lengths makes its image lie wholly inside the photo, and the principal point moves where the distortion is
// not centred: what COLMAP's undistorter does with blank_pixels = 0, at a fixed size.
#include <OpenImageIO/hash.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <mutex>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/files/opencv_pixels.h"
#include "scene/files/scene_folder.h"
#include "scene/files/taken_photos.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"
#include "scene/undistort/undistorter.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

constexpr int kJpegQuality = 95;
constexpr double kMaxTangent = 5.67;  // 80 degrees off axis: a plane beyond shows nothing but stretched pixels
constexpr int kMaxPhotoSide = 32766;  // of cv::remap

// A fisheye's border that looks too far to the side counts as having no ray.
Camera PinholeFor(const Camera& camera) {
  return PinholeInside({camera.width_px, camera.height_px}, camera.FocalPx(), camera.PrincipalPointPx(),
                       [&](const Eigen::Vector2d& x_px) {
                         const auto x = camera.Normalized(x_px);
                         return x && x->norm() <= kMaxTangent ? x : std::nullopt;
                       });
}

// For each pixel of the pinhole image the photo's pixel, in cv::remap's fixed-point form.
struct Maps {
  cv::Mat xy, fraction;
};

Maps MakeMaps(const Camera& camera, const Camera& pinhole) {
  cv::Mat source(pinhole.height_px, pinhole.width_px, CV_32FC2);
  const Eigen::Vector2d f = pinhole.FocalPx(), c = pinhole.PrincipalPointPx();
  ParallelFor(static_cast<std::size_t>(pinhole.height_px), 16, [&](std::size_t begin, std::size_t end) {
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      cv::Vec2f* row = source.ptr<cv::Vec2f>(y);
      for (int x = 0; x < pinhole.width_px; ++x) {
        const Eigen::Vector3d ray((x + 0.5 - c.x()) / f.x(), (y + 0.5 - c.y()) / f.y(), 1);
        const Eigen::Vector2d pixel = ToOpenCvPixel(*camera.Project(ray));
        row[x] = {static_cast<float>(pixel.x()), static_cast<float>(pixel.y())};
      }
    }
  });
  Maps maps;
  cv::convertMaps(source, cv::Mat(), maps.xy, maps.fraction, CV_16SC2);
  return maps;
}

std::string Key(const fs::path& photo, const Camera& camera) {
  std::error_code error;
  const auto size = fs::file_size(photo, error);
  if (error) throw InputError(photo, "there is no such picture");
  const auto time = fs::last_write_time(photo, error).time_since_epoch().count();
  std::string text =
      fmt::format("{} {} {} {}", fs::absolute(photo).lexically_normal().string(), size, time, Name(camera.model));
  for (const double p : camera.params) text += fmt::format(" {}", p);
  return fmt::format("{:016x}", OIIO::xxhash::XXH64(text.data(), text.size(), 0));
}

// Which photos of the target folder are done, and from what: a line each, added when the photo is complete, so that a
// run that was killed goes on. A torn last line counts for nothing.
class Record {
 public:
  explicit Record(fs::path file) : file_(std::move(file)) {
    std::error_code error;
    if (!fs::exists(file_, error)) return;
    std::istringstream lines(ReadText(file_));
    for (std::string line; std::getline(lines, line);) {
      std::istringstream words(line);
      Entry entry;
      std::string name;
      if (words >> entry.key >> entry.size && std::getline(words >> std::ws, name)) entries_[name] = entry;
    }
  }
  bool IsDone(const std::string& name, const std::string& key, const fs::path& output) const {
    const auto it = entries_.find(name);
    std::error_code error;
    return it != entries_.end() && it->second.key == key && fs::file_size(output, error) == it->second.size && !error;
  }
  void Add(const std::string& name, const std::string& key, const fs::path& output) {
    const std::string line = fmt::format("\n{} {} {}\n", key, fs::file_size(output), name);
    const std::lock_guard lock(mutex_);
    const int fd = ::open(file_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
    const bool written = fd >= 0 && ::write(fd, line.data(), line.size()) == static_cast<ssize_t>(line.size());
    if (fd >= 0) ::close(fd);
    if (!written) throw MachineError("cannot be written", "is the disk full?", file_);
  }

 private:
  struct Entry {
    std::string key;
    std::uintmax_t size = 0;
  };
  fs::path file_;
  std::map<std::string, Entry> entries_;
  std::mutex mutex_;
};

// Endings that undistorted photos keep; others (HEIC, EXR ...) become PNG.
bool CanKeepEnding(const fs::path& name) {
  std::string e = name.extension().string();
  std::transform(e.begin(), e.end(), e.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  constexpr std::array kEndings{".jpg", ".jpeg", ".jpe", ".png", ".tif", ".tiff"};
  return std::find(kEndings.begin(), kEndings.end(), e) != kEndings.end();
}

void LinkOrCopy(const fs::path& from, const fs::path& to) {
  WriteFileAtomically(to, [&](const fs::path& temporary) {
    std::error_code error;
    fs::create_hard_link(fs::canonical(from, error), temporary, error);
    if (!error) return;
    fs::copy_file(from, temporary, error);
    if (error) throw MachineError(fmt::format("cannot be copied: {}", error.message()), "is the disk full?", to);
  });
}

bool CanBeRead(const fs::path& photo) {
  try {
    return !ReadImage8(photo).empty();
  } catch (const InputError&) {
    return false;
  }
}

Image8 Undistorted(const Image8& photo, const Maps& maps) {
  Image8 result(maps.xy.cols, maps.xy.rows, photo.channels);
  const cv::Mat source(photo.height, photo.width, CV_8UC(photo.channels), const_cast<std::uint8_t*>(photo.data.data()));
  cv::Mat target(result.height, result.width, CV_8UC(result.channels), result.data.data());
  // The outermost half pixel has neighbours on one side only: the border is repeated there.
  cv::remap(source, target, maps.xy, maps.fraction, cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  return result;
}

}  // namespace

Scene UndistortPhotos(const Scene& scene, const fs::path& image_folder, ProgressSink& sink) {
  if (scene.frame != Frame::kMetric) throw std::invalid_argument("UndistortPhotos: not a metric scene");
  std::error_code error;
  fs::create_directories(image_folder, error);
  if (error)
    throw MachineError(fmt::format("cannot be made: {}", error.message()), "choose another output", image_folder);
  if (fs::equivalent(image_folder, scene.image_folder, error))
    throw UsageError(fmt::format("undistorted photos cannot replace their originals in {}", image_folder.string()));
  RemoveStaleTemporaries(image_folder);

  Scene result = scene;
  result.image_folder = image_folder;
  for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
    const Camera& c = scene.cameras[i];
    if (std::max(c.width_px, c.height_px) > kMaxPhotoSide)
      throw DataError(fmt::format("photos wider or higher than {} pixels cannot be undistorted", kMaxPhotoSide));
    const Eigen::Vector2d f = c.FocalPx(), p = c.PrincipalPointPx();
    result.cameras[i] =
        c.IsPinhole() ? Camera::Pinhole(c.width_px, c.height_px, f.x(), f.y(), p.x(), p.y()) : PinholeFor(c);
  }
  for (View& view : result.views)
    if (!scene.CameraOf(view).IsPinhole() && !CanKeepEnding(view.name)) view.name += ".png";
  for (Point& point : result.points) {
    std::vector<Observation> kept;
    for (Observation o : point.track) {
      const auto camera = static_cast<std::size_t>(scene.views[static_cast<std::size_t>(o.view.value)].camera.value);
      if (!scene.cameras[camera].IsPinhole()) {
        const auto x = scene.cameras[camera].Normalized(o.x_px);
        if (!x) continue;  // beyond the fold of the polynomial: there is no such ray
        o.x_px = result.cameras[camera].FocalPx().cwiseProduct(*x) + result.cameras[camera].PrincipalPointPx();
      }
      kept.push_back(o);
    }
    point.track = std::move(kept);
  }

  // Photos by camera: its maps are made once and shared.
  std::map<std::int32_t, std::vector<std::size_t>> views_of;
  Record record(image_folder / ".undistorted");
  const bool doubtful = RestartedSince(image_folder);
  NoteRunOfMachine(image_folder);
  Progress progress(sink, "undistorting photos", static_cast<long>(scene.views.size()));
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    const View& view = scene.views[i];
    const fs::path done = result.ImagePath(result.views[i]);
    if (record.IsDone(view.name, Key(scene.ImagePath(view), scene.CameraOf(view)), done) &&
        (!doubtful || CanBeRead(done)))
      progress.Step();
    else
      views_of[view.camera.value].push_back(i);
  }
  const auto convert = [&](std::size_t i, const Maps* maps) {
    const View& view = scene.views[i];
    const Camera& camera = scene.CameraOf(view);
    const fs::path from = scene.ImagePath(view), to = result.ImagePath(result.views[i]);
    const std::string key = Key(from, camera);
    if (!maps) {
      LinkOrCopy(from, to);
    } else {
      const Image8 photo = ReadImage8(from);
      if (photo.width != camera.width_px || photo.height != camera.height_px)
        throw InputError(from,
                         fmt::format("the photo is {} x {} pixels, its camera is for {} x {}", photo.width,
                                     photo.height, camera.width_px, camera.height_px),
                         "scale the cameras: --rescale-cameras of lumi-pipeline, lumi-render and lumi-view");
      WriteImage(to, Undistorted(photo, *maps), kJpegQuality);
    }
    record.Add(view.name, key, to);
    progress.Step();
  };
  std::vector<std::size_t> alone;  // photos with a camera of their own go side by side, each with its own maps
  for (const auto& [id, views_of_camera] : views_of) {
    const auto& views = views_of_camera;  // clang 14 hands no structured binding on to a lambda
    const auto camera = static_cast<std::size_t>(id);
    const bool pinhole = scene.cameras[camera].IsPinhole();
    if (views.size() == 1 && !pinhole) {
      alone.push_back(views.front());
      continue;
    }
    const Maps maps = pinhole ? Maps{} : MakeMaps(scene.cameras[camera], result.cameras[camera]);
    ParallelEach(views.size(), 1, [&](std::size_t k) { convert(views[k], pinhole ? nullptr : &maps); });
  }
  ParallelEach(alone.size(), 1, [&](std::size_t k) {
    const auto camera = static_cast<std::size_t>(scene.views[alone[k]].camera.value);
    const Maps maps = MakeMaps(scene.cameras[camera], result.cameras[camera]);
    convert(alone[k], &maps);
  });
  std::vector<TakenPhoto> taken;
  for (std::size_t i = 0; i < scene.views.size(); ++i)
    taken.push_back(
        {result.views[i].name, scene.views[i].name, scene.CameraOf(scene.views[i]), result.CameraOf(result.views[i])});
  WriteTakenPhotos(taken, image_folder);
  return result;
}

}  // namespace lumi
