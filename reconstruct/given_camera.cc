#include "reconstruct/given_camera.h"

#include <fmt/format.h>

#include <cmath>
#include <set>

#include "scene/files/atomic_file.h"
#include "scene/files/camera_yaml.h"
#include "scene/files/image_io.h"
#include "scene/files/scene_folder.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"
#include "scene/undistort/undistorter.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

constexpr const char* kLensFile = ".lens";  // in a folder of resampled photos: the lens that they were resampled from
constexpr int kResampledJpegQuality = 97;   // resampled once more than other photos: the file must not add to it

std::string LensText(const Camera& c) {
  return fmt::format("{} {} {:.17g}\n", c.width_px, c.height_px, fmt::join(c.params, " "));
}

// Skew and k3: COLMAP's FULL_OPENCV has a k3, but no scene of ours is kept in it.
bool IsBeyondColmap(const Camera& camera) {
  return camera.Get(CameraTerm::kSkew) != 0 || camera.Get(CameraTerm::kK3) != 0;
}

// A folder for resampled files: empty, or what an earlier run made with the same lens.
void Prepare(const fs::path& folder, const Camera& camera) {
  std::error_code error;
  if (!fs::exists(folder / kLensFile, error) || ReadText(folder / kLensFile) != LensText(camera))
    fs::remove_all(folder, error);
  fs::create_directories(folder);
  WriteTextAtomically(folder / kLensFile, LensText(camera));
}

bool IsNewer(const fs::path& made, const fs::path& source) {
  std::error_code error;
  const auto made_time = fs::last_write_time(made, error);
  return !error && made_time >= fs::last_write_time(source, error) && !error;
}

void ResampleMasks(const Capture& capture, const Camera& camera, const fs::path& masks, const fs::path& folder) {
  Prepare(folder, camera);
  const Undistorter undistort(camera, PinholeInside(camera));
  for (const InputPhoto& photo : capture.photos) {
    const std::string name = photo.name + ".png";
    const fs::path source = FindMask(masks, photo.name);
    if (source.empty() || IsNewer(folder / name, source)) continue;
    const Image8 rgb = ReadImage8(source);
    Image8 mask(rgb.width, rgb.height, 1);
    for (int y = 0; y < rgb.height; ++y)
      for (int x = 0; x < rgb.width; ++x) mask.At(x, y, 0) = rgb.At(x, y, 0);
    WriteImage(folder / name, undistort.Mask(mask));
  }
}

}  // namespace

bool SameShape(int camera_width_px, int camera_height_px, int width_px, int height_px) {
  const double wide = static_cast<double>(camera_height_px) * width_px / camera_width_px;
  const double high = static_cast<double>(camera_width_px) * height_px / camera_height_px;
  return std::abs(wide - height_px) <= 1 || std::abs(high - width_px) <= 1;
}

void RequireScalable(int camera_width_px, int camera_height_px, int width_px, int height_px, bool rescale,
                     const fs::path& camera) {
  if (rescale || SameShape(camera_width_px, camera_height_px, width_px, height_px)) return;
  const bool turned = SameShape(camera_height_px, camera_width_px, width_px, height_px);
  throw DataError(fmt::format("the camera is for {}x{} pixels, the photos have {}x{}{}", camera_width_px,
                              camera_height_px, width_px, height_px, turned ? ": they are turned" : ", another shape"),
                  turned ? "turn the photos as they were when the camera was calibrated"
                         : "--rescale-cameras if the photos were squeezed, not cropped",
                  camera);
}

void CheckGivenCamera(const ReconstructOptions& options, const std::set<std::pair<int, int>>& sizes_px) {
  if (options.camera_yaml.empty()) return;
  const Camera camera = ReadWholeCameraYaml(options.camera_yaml).camera;
  const bool resampled = IsBeyondColmap(camera);
  if (resampled && sizes_px.size() > 1)
    throw DataError("one camera.yaml for photos of different sizes",
                    "leave out the photos of other cameras, or leave out --camera", options.camera_yaml);
  if (resampled && !options.database.empty())
    throw UsageError(
        fmt::format("{} has {}, so the photos are resampled, and the features of --database are not theirs",
                    options.camera_yaml.filename().string(), camera.Get(CameraTerm::kSkew) != 0 ? "skew" : "a k3"),
        "leave out --database, or calibrate with --model rect-k1k2p");
  if (sizes_px.size() == 1)
    RequireScalable(camera.width_px, camera.height_px, sizes_px.begin()->first, sizes_px.begin()->second,
                    options.rescale_cameras, options.camera_yaml);
  if (resampled) PinholeInside(camera);  // throws where the lens leaves no picture
}

Capture Resampled(const Capture& capture, const Camera& camera, const fs::path& folder, ProgressSink& sink) {
  Prepare(folder, camera);
  const Undistorter undistort(camera, PinholeInside(camera));
  Capture straight = capture;
  straight.folder = folder;
  straight.resampled = true;
  Progress progress(sink, "resampling without skew and distortion", static_cast<long>(capture.photos.size()));
  ParallelEach(capture.photos.size(), 1, [&](std::size_t i) {
    const fs::path from = capture.folder / capture.photos[i].name, to = folder / capture.photos[i].name;
    if (!IsNewer(to, from)) {
      fs::create_directories(to.parent_path());
      WriteImage(to, undistort(ReadImage8(from)), kResampledJpegQuality);
    }
    progress.Step();
  });
  return straight;
}

GivenCamera FitGivenCamera(const ReconstructOptions& options, const Capture& capture, const fs::path& work_folder,
                           ProgressSink& sink) {
  GivenCamera given{options.camera_yaml, options.masks, {}, capture.folder, capture};
  if (options.camera_yaml.empty()) return given;
  const CameraYaml yaml = ReadWholeCameraYaml(options.camera_yaml);
  const std::string name = options.camera_yaml.filename().string();
  if (!yaml.says_distortion)
    sink.Message(fmt::format("{} has no distortion coefficients: taken as a lens without distortion", name));

  std::set<std::pair<int, int>> sizes;
  for (const InputPhoto& photo : capture.photos) sizes.insert({photo.width_px, photo.height_px});
  CheckGivenCamera(options, sizes);
  if (sizes.size() != 1) return given;  // later steps scale the camera for each photo, or refuse
  const auto [width, height] = *sizes.begin();
  Camera lens = yaml.camera;
  const bool other_size = lens.width_px != width || lens.height_px != height;
  if (other_size) {
    sink.Message(fmt::format("{} is for {}x{} pixels, the photos have {}x{}: the camera is scaled", name, lens.width_px,
                             lens.height_px, width, height));
    lens = lens.Scaled(width, height);
  }
  const fs::path fitted = work_folder / "camera.yaml";
  if (!IsBeyondColmap(lens)) {
    if (!other_size) return given;
    WriteCameraYaml(lens, fitted);
    given.yaml = fitted;
    return given;
  }

  const bool skew = lens.Get(CameraTerm::kSkew) != 0, k3 = lens.Get(CameraTerm::kK3) != 0;
  sink.Message(fmt::format(
      "{} has {}, which COLMAP's models cannot hold: the photos are resampled without {} and without distortion", name,
      skew && k3 ? "skew and k3"
      : skew     ? "skew"
                 : "a k3",
      skew ? "skew" : "it"));
  given.capture = Resampled(capture, lens, work_folder / "straight", sink);
  if (!options.masks.empty()) ResampleMasks(capture, lens, options.masks, given.masks = work_folder / "straight-masks");
  WriteCameraYaml(PinholeInside(lens), fitted);
  given.yaml = fitted;
  given.resampled = lens;
  return given;
}

}  // namespace lumi
