#include "reconstruct/known_cameras.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <functional>
#include <map>
#include <opencv2/imgproc.hpp>

#include "reconstruct/given_camera.h"
#include "reconstruct/poses_file.h"
#include "scene/files/camera_yaml.h"
#include "scene/files/image_io.h"
#include "scene/files/opencv_pixels.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"

namespace lumi {
namespace {

std::string WithoutEnding(const std::string& name) {
  const auto slash = name.find_last_of('/');
  const auto dot = name.find_last_of('.');
  return dot == std::string::npos || (slash != std::string::npos && dot < slash) ? name : name.substr(0, dot);
}

// "images/viff.001.png" -> "viff001"
std::string LettersAndDigits(const std::string& name) {
  const std::string stem = WithoutEnding(name);
  std::string key;
  for (const char c : stem.substr(stem.find_last_of('/') == std::string::npos ? 0 : stem.find_last_of('/') + 1))
    if (std::isalnum(static_cast<unsigned char>(c)))
      key += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return key;
}

Camera WithoutDistortion(const Camera& camera) {
  const Eigen::Vector2d f = camera.FocalPx(), c = camera.PrincipalPointPx();
  return Camera::Pinhole(camera.width_px, camera.height_px, f.x(), f.y(), c.x(), c.y());
}

// The camera of one photo, from the file or from the options, at the photo's size.
HeldView Hold(const PosedCamera& posed, const InputPhoto& photo, const ReconstructOptions& options) {
  HeldView view;
  view.name = photo.name;
  view.cam_from_world = posed.cam_from_world;
  const double shift_px =
      options.pixel_origin == PixelOrigin::kCentre ? FromOpenCvPixel(Eigen::Vector2d::Zero()).x() : 0.0;
  if (const auto given = IntrinsicsFromOptions(options, photo.width_px, photo.height_px)) {
    view.camera = *given;
  } else if (posed.camera) {
    view.camera = posed.camera->WithPinhole(posed.camera->FocalPx(),
                                            posed.camera->PrincipalPointPx() + Eigen::Vector2d::Constant(shift_px));
    if (view.camera.width_px != photo.width_px || view.camera.height_px != photo.height_px) {
      if (!options.rescale_cameras)
        throw DataError(fmt::format("the camera of {} is for {}x{} pixels, the photo has {}x{}", photo.name,
                                    view.camera.width_px, view.camera.height_px, photo.width_px, photo.height_px),
                        "--rescale-cameras if the photos were scaled down as a whole", options.poses);
      view.camera = view.camera.Scaled(photo.width_px, photo.height_px);
      if (!view.camera.IsPinhole()) view.undistorted_alternative = WithoutDistortion(view.camera);
    }
  } else if (posed.K) {
    const Eigen::Matrix3d& K = *posed.K;
    // With skew s: x = fx X + s Y + cx, y = fy Y + cy. Sheared by k = s / fy about the middle row, x' = x - k (y - h/2)
    // has no Y any more.
    view.shear = K(0, 1) / K(1, 1);
    const double cx = K(0, 2) + shift_px, cy = K(1, 2) + shift_px;
    view.camera = Camera::Pinhole(photo.width_px, photo.height_px, K(0, 0), K(1, 1),
                                  cx - view.shear * (cy - photo.height_px / 2.0), cy);
  } else {
    throw UsageError(fmt::format("{} tells where the cameras are, not their focal length", options.poses.string()),
                     "give --focal-px F, --intrinsics fx,fy,cx,cy or --camera camera.yaml");
  }
  if (const auto wrong = Validate(view.camera))
    throw InputError(options.poses, fmt::format("camera of {}: {}", photo.name, *wrong));
  return view;
}

}  // namespace

std::vector<HeldView> Mirrored(const std::vector<HeldView>& views) {
  // -K [R | t] diag(1, 1, -1, 1) = K [R diag(-1, -1, 1) | -t]
  std::vector<HeldView> mirrored = views;
  const Eigen::Quaterniond half_turn(0, 0, 0, 1);  // diag(-1, -1, 1)
  for (HeldView& view : mirrored)
    view.cam_from_world = {(view.cam_from_world.rotation * half_turn).normalized(), -view.cam_from_world.translation};
  return mirrored;
}

Camera WithSkew(const HeldView& view) {
  const Camera& c = view.camera;
  const Eigen::Vector2d f = c.FocalPx(), p = c.PrincipalPointPx();
  // x is sheared by shear * (y - height / 2), where y is f_y Y / Z + c_y.
  return {CameraModel::kPlumbBob,
          c.width_px,
          c.height_px,
          {f.x(), f.y(), p.x() + view.shear * (p.y() - 0.5 * c.height_px), p.y(), view.shear * f.y(), 0, 0, 0, 0, 0}};
}

bool HasSkew(const std::vector<HeldView>& views, const Capture& capture) {
  constexpr double kShownPx = 0.25;
  const int height_px = capture.photos.empty() ? 0 : capture.photos.front().height_px;
  return std::ranges::any_of(views, [&](const HeldView& v) { return std::abs(v.shear) * height_px / 2 > kShownPx; });
}

Capture RemoveSkew(const Capture& capture, const std::vector<HeldView>& views, const std::filesystem::path& staging,
                   ProgressSink& sink) {
  Capture straight = capture;
  straight.folder = staging;
  std::map<std::string, double> shear_of;
  for (const HeldView& view : views) shear_of[view.name] = view.shear;
  std::erase_if(straight.photos, [&](const InputPhoto& photo) { return shear_of.count(photo.name) == 0; });
  Progress progress(sink, "removing skew", static_cast<long>(straight.photos.size()));
  constexpr int kJpegQuality = 97;  // resampled once more than other photos: the file must not add to it
  ParallelEach(straight.photos.size(), 1, [&](std::size_t i) {
    const std::string& name = straight.photos[i].name;
    Image8 photo = ReadImage8(capture.folder / name);
    Image8 result(photo.width, photo.height, 3);
    cv::Mat from(photo.height, photo.width, CV_8UC3, photo.data.data()),
        to(result.height, result.width, CV_8UC3, result.data.data());
    // OpenCV asks where each new pixel comes from; the middle row is at h/2 - 0.5 of its pixels.
    const double k = shear_of[name];
    const cv::Matx23d source_from_target(1, k, -k * (photo.height / 2.0 - 0.5), 0, 1, 0);
    cv::warpAffine(from, to, source_from_target, to.size(), cv::INTER_LANCZOS4 | cv::WARP_INVERSE_MAP,
                   cv::BORDER_REPLICATE);
    WriteImage(staging / name, result, kJpegQuality);
    progress.Step();
  });
  return straight;
}

std::vector<int> MatchNames(const std::vector<std::string>& names, const std::vector<InputPhoto>& photos) {
  // Each way of telling names apart is looser than the one before: whole; without ending; with ever fewer of the
  // folders that hold them (cameras may be named from another folder than photos); without folders; letters and digits
  // alone. Two names that one way does not tell apart match nothing by it.
  using Way = std::function<std::string(const std::string&)>;
  const auto with_folders = [](int folders) -> Way {
    return [folders](const std::string& name) {
      std::size_t begin = name.size();
      for (int i = 0; i <= folders && begin != std::string::npos; ++i)
        begin = begin == 0 ? std::string::npos : name.find_last_of('/', begin - 1);
      return WithoutEnding(begin == std::string::npos ? name : name.substr(begin + 1));
    };
  };
  const auto file = [](const std::string& name) { return name.substr(name.find_last_of('/') + 1); };
  const std::array ways = {Way([](const std::string& n) { return n; }),
                           Way(WithoutEnding),
                           with_folders(3),
                           with_folders(2),
                           with_folders(1),
                           Way(file),
                           Way(LettersAndDigits)};
  constexpr int kAmbiguous = -2;
  std::array<std::map<std::string, int>, ways.size()> by;
  for (std::size_t way = 0; way < ways.size(); ++way)
    for (std::size_t i = 0; i < names.size(); ++i) {
      const auto [it, fresh] = by[way].emplace(ways[way](names[i]), static_cast<int>(i));
      if (!fresh) it->second = kAmbiguous;
    }
  std::vector<int> match;
  for (const InputPhoto& photo : photos) {
    // A converted photo is called NAME.ending.png.
    const std::string name = !photo.original.empty()  ? photo.original
                             : photo.needs_conversion ? WithoutEnding(photo.name)
                                                      : photo.name;
    int found = -1;
    for (std::size_t way = 0; way < ways.size() && found < 0; ++way)
      if (const auto it = by[way].find(ways[way](name)); it != by[way].end()) found = it->second;
    match.push_back(std::max(found, -1));
  }
  return match;
}

std::optional<Camera> IntrinsicsFromOptions(const ReconstructOptions& options, int width_px, int height_px) {
  if (!options.camera_yaml.empty()) {
    const Camera camera = ReadCameraYaml(options.camera_yaml);
    if (camera.width_px == width_px && camera.height_px == height_px) return camera;
    RequireScalable(camera.width_px, camera.height_px, width_px, height_px, options.rescale_cameras,
                    options.camera_yaml);
    return camera.Scaled(width_px, height_px);
  }
  if (!options.intrinsics.empty()) {
    const double shift_px = options.pixel_origin == PixelOrigin::kCentre ? 0.5 : 0.0;
    const auto& k = options.intrinsics;
    return Camera::Pinhole(width_px, height_px, k[0], k[1], k[2] + shift_px, k[3] + shift_px);
  }
  if (options.focal_px)
    return Camera::Pinhole(width_px, height_px, *options.focal_px, *options.focal_px, width_px / 2.0, height_px / 2.0);
  return std::nullopt;
}

std::vector<HeldView> ReadKnownCameras(const Capture& capture, const ReconstructOptions& options,
                                       std::vector<MissingPhoto>* missing, ProgressSink& sink) {
  const std::vector<PosedCamera> posed = ReadPosesFile(options.poses, options.poses_format);
  const bool named = !posed.front().name.empty();
  std::vector<int> match;
  if (named) {
    std::vector<std::string> names;
    for (const PosedCamera& camera : posed) names.push_back(camera.name);
    match = MatchNames(names, capture.photos);
  } else {
    if (static_cast<int>(posed.size()) != capture.total())
      throw DataError(fmt::format("{} cameras without names for {} photos", posed.size(), capture.total()),
                      "a list without names needs one line for each photo, in the order of the photos' names",
                      options.poses);
    // A photo that cannot be read keeps its line.
    std::vector<std::string> names;
    for (const InputPhoto& photo : capture.photos) names.push_back(photo.name);
    for (const auto& bad : capture.unreadable) names.push_back(bad.name);
    std::ranges::sort(names);
    for (const InputPhoto& photo : capture.photos)
      match.push_back(static_cast<int>(std::ranges::lower_bound(names, photo.name) - names.begin()));
  }
  std::vector<HeldView> views;
  for (std::size_t i = 0; i < capture.photos.size(); ++i) {
    const InputPhoto& photo = capture.photos[i];
    if (match[i] < 0) {
      missing->push_back({photo.name, "no pose for it in " + options.poses.filename().string(),
                          "add it, or reconstruct without --poses"});
      continue;
    }
    views.push_back(Hold(posed[static_cast<std::size_t>(match[i])], photo, options));
  }
  if (views.size() < 2)
    throw DataError(
        fmt::format("{} of the {} cameras belong to photos here (the file has {}, the photos {})", views.size(),
                    posed.size(), posed.front().name.empty() ? "no names" : posed.front().name,
                    capture.photos.front().name),
        "names are compared without folder and ending", options.poses);
  if (named && posed.size() > views.size())
    sink.Message(fmt::format("{} cameras have no photo here", posed.size() - views.size()));
  return views;
}

}  // namespace lumi
