#include "scene/files/colmap_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <set>
#include <stdexcept>
#include <unordered_map>

#include "scene/files/atomic_file.h"
#include "scene/files/byte_cursor.h"
#include "scene/files/file_name.h"
#include "scene/files/open_to_read.h"
#include "scene/files/text_scan.h"
#include "scene/program/error.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

using text_scan::NextLine;
using text_scan::NextNumber;
using text_scan::NextWord;
using text_scan::Trim;

constexpr std::size_t kMaxModelBytes = std::size_t(1) << 35;
constexpr std::uint64_t kNoPoint = ~std::uint64_t{0};

// A model as its files have it, before ids become positions.
struct RawImage {
  std::uint32_t id = 0;
  std::uint32_t camera = 0;
  std::string name;
  Rigid3 cam_from_world;
  std::vector<std::pair<Eigen::Vector2d, std::uint64_t>> points;  // only those with a 3D point
};
struct RawModel {
  std::map<std::uint32_t, Camera> cameras;
  std::vector<RawImage> images;
  std::map<std::uint64_t, Point> points;
  bool has_points_file = false;
};

// COLMAP's further models, to be named when they are refused.
const char* UnsupportedModelName(int id) {
  constexpr const char* kNames[] = {"FULL_OPENCV",           "FOV",
                                    "SIMPLE_RADIAL_FISHEYE", "RADIAL_FISHEYE",
                                    "THIN_PRISM_FISHEYE",    "RAD_TAN_THIN_PRISM_FISHEYE"};
  return id >= 6 && id < 12 ? kNames[id - 6] : nullptr;
}
InputError UnsupportedModel(const fs::path& file, const std::string& name) {
  return InputError(file, fmt::format("camera model {} is not read", name),
                    "undistort the photos with COLMAP (image_undistorter) and open its output");
}

void AddCamera(const fs::path& file, std::uint32_t id, Camera camera, RawModel& model) {
  if (const auto wrong = Validate(camera)) throw InputError(file, fmt::format("camera {}: {}", id, *wrong));
  if (!model.cameras.emplace(id, std::move(camera)).second)
    throw InputError(file, fmt::format("camera {} comes twice", id));
}

void CheckImage(const fs::path& file, const RawModel& model, RawImage& image) {
  const auto fail = [&](const std::string& what) {
    return InputError(file, fmt::format("image {}: {}", image.id, what));
  };
  const Eigen::Quaterniond& q = image.cam_from_world.rotation;
  if (!q.coeffs().allFinite() || !image.cam_from_world.translation.allFinite())
    throw fail("the pose is not a finite number");
  if (!(q.norm() > 1e-6) || !(q.norm() < 1e6)) throw fail("the rotation is no quaternion");
  image.cam_from_world.rotation.normalize();
  if (image.name.empty()) throw fail("has no name");
  // Names become paths, for writing too: they stay below the photos' folder.
  if (!StaysWithin(image.name)) throw fail(fmt::format("the name \"{}\" leads out of the photos' folder", image.name));
  if (!model.cameras.contains(image.camera))
    throw fail(fmt::format("names camera {}, which is not there", image.camera));
}

void AddPoint(const fs::path& file, std::uint64_t id, Point point, RawModel& model) {
  if (!point.x_in_world.allFinite()) throw InputError(file, fmt::format("point {} is not a finite number", id));
  if (!std::isfinite(point.error_px) || point.error_px < 0) point.error_px = 0;  // COLMAP writes -1 where it has none
  if (!model.points.emplace(id, std::move(point)).second)
    throw InputError(file, fmt::format("point {} comes twice", id));
}

int ImageSide(const fs::path& file, std::uint32_t camera, std::uint64_t side) {
  constexpr std::uint64_t kMaxSide = 1 << 20;
  if (side == 0 || side > kMaxSide)
    throw InputError(file, fmt::format("camera {}: an image {} pixels wide or high", camera, side));
  return static_cast<int>(side);
}

// --- Binary ------------------------------------------------------------------------------------------------------

void ReadCamerasBinary(const fs::path& file, RawModel& model) {
  const std::string bytes = ReadText(file, kMaxModelBytes);
  ByteCursor in(bytes, file);
  const std::size_t count = in.ReadCount<std::uint64_t>(4 + 4 + 8 + 8 + 3 * 8, "cameras");
  for (std::size_t i = 0; i < count; ++i) {
    const auto id = in.Read<std::uint32_t>("cameras");
    const auto model_id = in.Read<std::int32_t>("cameras");
    const auto known = CameraModelFromId(model_id);
    if (!known) {
      const char* name = UnsupportedModelName(model_id);
      throw UnsupportedModel(file, name ? std::string(name) : fmt::format("number {}", model_id));
    }
    Camera camera;
    camera.model = *known;
    camera.width_px = ImageSide(file, id, in.Read<std::uint64_t>("cameras"));
    camera.height_px = ImageSide(file, id, in.Read<std::uint64_t>("cameras"));
    for (int k = 0; k < ParameterCount(*known); ++k) camera.params.push_back(in.Read<double>("cameras"));
    AddCamera(file, id, std::move(camera), model);
  }
}

void ReadImagesBinary(const fs::path& file, RawModel& model) {
  const std::string bytes = ReadText(file, kMaxModelBytes);
  ByteCursor in(bytes, file);
  const std::size_t count = in.ReadCount<std::uint64_t>(4 + 7 * 8 + 4 + 1 + 8, "images");
  for (std::size_t i = 0; i < count; ++i) {
    RawImage image;
    image.id = in.Read<std::uint32_t>("images");
    double pose[7];
    for (double& v : pose) v = in.Read<double>("images");
    image.cam_from_world = {Eigen::Quaterniond(pose[0], pose[1], pose[2], pose[3]), {pose[4], pose[5], pose[6]}};
    image.camera = in.Read<std::uint32_t>("images");
    image.name = in.ReadString("the name of an image");
    CheckImage(file, model, image);
    const std::size_t points = in.ReadCount<std::uint64_t>(3 * 8, "points of an image");
    for (std::size_t k = 0; k < points; ++k) {
      const double x = in.Read<double>("images"), y = in.Read<double>("images");
      const auto point = in.Read<std::uint64_t>("images");
      if (point == kNoPoint) continue;
      if (!std::isfinite(x) || !std::isfinite(y))
        throw InputError(file, fmt::format("image {}: a point is not a finite number", image.id));
      image.points.emplace_back(Eigen::Vector2d(x, y), point);
    }
    model.images.push_back(std::move(image));
  }
}

void ReadPointsBinary(const fs::path& file, RawModel& model) {
  const std::string bytes = ReadText(file, kMaxModelBytes);
  ByteCursor in(bytes, file);
  const std::size_t count = in.ReadCount<std::uint64_t>(8 + 3 * 8 + 3 + 8 + 8, "points");
  for (std::size_t i = 0; i < count; ++i) {
    const auto id = in.Read<std::uint64_t>("points");
    Point point;
    for (int k = 0; k < 3; ++k) point.x_in_world[k] = in.Read<double>("points");
    for (auto& c : point.color) c = in.Read<std::uint8_t>("points");
    point.error_px = in.Read<double>("points");
    const std::size_t track = in.ReadCount<std::uint64_t>(4 + 4, "images of a point");
    for (std::size_t k = 0; k < track; ++k) in.Read<std::uint64_t>("images of a point");  // the images say it as well
    AddPoint(file, id, std::move(point), model);
  }
}

// --- Text --------------------------------------------------------------------------------------------------------

// Lines that say something, with their numbers.
class Lines {
 public:
  Lines(const fs::path& file, std::string_view text) : file_(file), text_(text) {}
  bool Next(std::string_view& line) {
    while (NextAny(line))
      if (!line.empty() && line.front() != '#') return true;
    return false;
  }
  // The very next one, whatever it is.
  bool NextAny(std::string_view& line) {
    if (!NextLine(text_, line)) return false;
    ++number_;
    line = Trim(line);
    return true;
  }
  InputError Fail(const std::string& what) const {
    return InputError(file_, fmt::format("line {}: {}", number_, what));
  }
  template <typename T>
  T Number(std::string_view& line, const char* what) const {
    const auto value = NextNumber<T>(line);
    if (!value) throw Fail(fmt::format("{}: a number is missing or wrong", what));
    return *value;
  }

 private:
  const fs::path& file_;
  std::string_view text_;
  std::size_t number_ = 0;
};

void ReadCamerasText(const fs::path& file, RawModel& model) {
  const std::string text = ReadText(file, kMaxModelBytes);
  Lines lines(file, text);
  for (std::string_view line; lines.Next(line);) {
    const auto id = lines.Number<std::uint32_t>(line, "camera id");
    const std::string_view name = NextWord(line);
    const auto known = CameraModelFromName(name);
    if (!known) throw UnsupportedModel(file, std::string(name.substr(0, 40)));
    Camera camera;
    camera.model = *known;
    camera.width_px = ImageSide(file, id, lines.Number<std::uint64_t>(line, "width"));
    camera.height_px = ImageSide(file, id, lines.Number<std::uint64_t>(line, "height"));
    while (!Trim(line).empty()) camera.params.push_back(lines.Number<double>(line, "camera parameters"));
    AddCamera(file, id, std::move(camera), model);
  }
}

void ReadImagesText(const fs::path& file, RawModel& model) {
  const std::string text = ReadText(file, kMaxModelBytes);
  Lines lines(file, text);
  for (std::string_view line; lines.Next(line);) {
    RawImage image;
    image.id = lines.Number<std::uint32_t>(line, "image id");
    double pose[7];
    for (double& v : pose) v = lines.Number<double>(line, "pose");
    image.cam_from_world = {Eigen::Quaterniond(pose[0], pose[1], pose[2], pose[3]), {pose[4], pose[5], pose[6]}};
    image.camera = lines.Number<std::uint32_t>(line, "camera id");
    image.name = Trim(line);  // may have blanks inside
    CheckImage(file, model, image);
    if (lines.NextAny(line))
      while (!Trim(line).empty()) {
        const auto x = lines.Number<double>(line, "points of an image"),
                   y = lines.Number<double>(line, "points of an image");
        const auto point = lines.Number<std::int64_t>(line, "points of an image");
        if (point < 0) continue;
        if (!std::isfinite(x) || !std::isfinite(y)) throw lines.Fail("a point is not a finite number");
        image.points.emplace_back(Eigen::Vector2d(x, y), static_cast<std::uint64_t>(point));
      }
    model.images.push_back(std::move(image));
  }
}

void ReadPointsText(const fs::path& file, RawModel& model) {
  const std::string text = ReadText(file, kMaxModelBytes);
  Lines lines(file, text);
  for (std::string_view line; lines.Next(line);) {
    const auto id = lines.Number<std::uint64_t>(line, "point id");
    Point point;
    for (int k = 0; k < 3; ++k) point.x_in_world[k] = lines.Number<double>(line, "point");
    for (auto& c : point.color) c = lines.Number<std::uint8_t>(line, "colour");
    point.error_px = lines.Number<double>(line, "error");
    AddPoint(file, id, std::move(point), model);
  }
}

// --- From ids to positions ---------------------------------------------------------------------------------------

Scene ToScene(const fs::path& images_file, RawModel&& model) {
  Scene scene;
  std::map<std::uint32_t, CameraId> camera_of;
  for (auto& [id, camera] : model.cameras) {
    camera_of[id] = {static_cast<std::int32_t>(scene.cameras.size())};
    scene.cameras.push_back(std::move(camera));
  }
  std::sort(model.images.begin(), model.images.end(),
            [](const RawImage& a, const RawImage& b) { return a.name < b.name; });
  std::set<std::uint32_t> ids;
  std::unordered_map<std::uint64_t, std::size_t> point_of;
  for (auto& [id, point] : model.points) {
    point_of.emplace(id, scene.points.size());
    scene.points.push_back(std::move(point));
  }
  for (const RawImage& image : model.images) {
    if (!ids.insert(image.id).second) throw InputError(images_file, fmt::format("image {} comes twice", image.id));
    if (!scene.views.empty() && scene.views.back().name == image.name)
      throw InputError(images_file, fmt::format("the name \"{}\" comes twice", image.name));
    const ViewId view{static_cast<std::int32_t>(scene.views.size())};
    View v;
    v.name = image.name;
    v.camera = camera_of.at(image.camera);
    v.cam_from_world = image.cam_from_world;
    scene.views.push_back(std::move(v));
    if (!model.has_points_file) continue;
    for (const auto& [x_px, id] : image.points) {
      const auto found = point_of.find(id);
      if (found == point_of.end())
        throw InputError(images_file, fmt::format("image {} sees point {}, which is not there", image.id, id));
      scene.points[found->second].track.push_back({view, x_px});
    }
  }
  return scene;
}

// Ids in files: position + 1. Where a point is among the points of each view that sees it.
struct Feature {
  Eigen::Vector2d x_px;
  std::size_t point;
};
struct Tracks {
  std::vector<std::vector<Feature>> features;          // a view
  std::vector<std::vector<std::uint32_t>> feature_of;  // a point and its track: index among the view's features
};

Tracks ListFeatures(const Scene& scene) {
  Tracks tracks;
  tracks.features.resize(scene.views.size());
  tracks.feature_of.resize(scene.points.size());
  for (std::size_t p = 0; p < scene.points.size(); ++p)
    for (const Observation& o : scene.points[p].track) {
      auto& features = tracks.features.at(static_cast<std::size_t>(o.view.value));
      tracks.feature_of[p].push_back(static_cast<std::uint32_t>(features.size()));
      features.push_back({o.x_px, p});
    }
  return tracks;
}

void WriteBinary(const Scene& scene, const Tracks& tracks, const fs::path& folder) {
  std::string cameras, images, points;
  AppendLittleEndian(cameras, std::uint64_t{scene.cameras.size()});
  for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
    const Camera& c = scene.cameras[i];
    AppendLittleEndian(cameras, static_cast<std::uint32_t>(i + 1));
    AppendLittleEndian(cameras, static_cast<std::int32_t>(c.model));
    AppendLittleEndian(cameras, static_cast<std::uint64_t>(c.width_px));
    AppendLittleEndian(cameras, static_cast<std::uint64_t>(c.height_px));
    for (const double p : c.params) AppendLittleEndian(cameras, p);
  }
  AppendLittleEndian(images, std::uint64_t{scene.views.size()});
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    const View& v = scene.views[i];
    AppendLittleEndian(images, static_cast<std::uint32_t>(i + 1));
    const Eigen::Quaterniond& q = v.cam_from_world.rotation;
    for (const double value : {q.w(), q.x(), q.y(), q.z()}) AppendLittleEndian(images, value);
    for (int k = 0; k < 3; ++k) AppendLittleEndian(images, v.cam_from_world.translation[k]);
    AppendLittleEndian(images, static_cast<std::uint32_t>(v.camera.value + 1));
    images.append(v.name).push_back('\0');
    AppendLittleEndian(images, std::uint64_t{tracks.features[i].size()});
    for (const Feature& f : tracks.features[i]) {
      AppendLittleEndian(images, f.x_px.x());
      AppendLittleEndian(images, f.x_px.y());
      AppendLittleEndian(images, std::uint64_t{f.point + 1});
    }
  }
  AppendLittleEndian(points, std::uint64_t{scene.points.size()});
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    const Point& p = scene.points[i];
    AppendLittleEndian(points, std::uint64_t{i + 1});
    for (int k = 0; k < 3; ++k) AppendLittleEndian(points, p.x_in_world[k]);
    for (const std::uint8_t c : p.color) AppendLittleEndian(points, c);
    AppendLittleEndian(points, p.error_px);
    AppendLittleEndian(points, std::uint64_t{p.track.size()});
    for (std::size_t k = 0; k < p.track.size(); ++k) {
      AppendLittleEndian(points, static_cast<std::uint32_t>(p.track[k].view.value + 1));
      AppendLittleEndian(points, tracks.feature_of[i][k]);
    }
  }
  WriteTextAtomically(folder / "cameras.bin", cameras);
  WriteTextAtomically(folder / "points3D.bin", points);
  WriteTextAtomically(folder / "images.bin", images);
}

void WriteText(const Scene& scene, const Tracks& tracks, const fs::path& folder) {
  // {} prints the shortest text that reads back as the same double.
  fmt::memory_buffer cameras, images, points;
  auto out = std::back_inserter(cameras);
  fmt::format_to(out, "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n");
  for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
    const Camera& c = scene.cameras[i];
    fmt::format_to(out, "{} {} {} {}", i + 1, Name(c.model), c.width_px, c.height_px);
    for (const double p : c.params) fmt::format_to(out, " {}", p);
    fmt::format_to(out, "\n");
  }
  out = std::back_inserter(images);
  fmt::format_to(out, "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n# POINTS2D[] as (X, Y, POINT3D_ID)\n");
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    const View& v = scene.views[i];
    const Eigen::Quaterniond& q = v.cam_from_world.rotation;
    const Eigen::Vector3d& t = v.cam_from_world.translation;
    fmt::format_to(out, "{} {} {} {} {} {} {} {} {} {}\n", i + 1, q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z(),
                   v.camera.value + 1, v.name);
    const char* separator = "";
    for (const Feature& f : tracks.features[i]) {
      fmt::format_to(out, "{}{} {} {}", separator, f.x_px.x(), f.x_px.y(), f.point + 1);
      separator = " ";
    }
    fmt::format_to(out, "\n");
  }
  out = std::back_inserter(points);
  fmt::format_to(out, "# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n");
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    const Point& p = scene.points[i];
    const Eigen::Vector3d& x = p.x_in_world;
    fmt::format_to(out, "{} {} {} {} {} {} {} {}", i + 1, x.x(), x.y(), x.z(), p.color[0], p.color[1], p.color[2],
                   p.error_px);
    for (std::size_t k = 0; k < p.track.size(); ++k)
      fmt::format_to(out, " {} {}", p.track[k].view.value + 1, tracks.feature_of[i][k]);
    fmt::format_to(out, "\n");
  }
  WriteTextAtomically(folder / "cameras.txt", fmt::to_string(cameras));
  WriteTextAtomically(folder / "points3D.txt", fmt::to_string(points));
  WriteTextAtomically(folder / "images.txt", fmt::to_string(images));
}

bool HoldsModel(const fs::path& folder, const char* extension) {
  std::error_code error;
  return fs::is_regular_file(folder / (std::string("cameras") + extension), error) &&
         fs::is_regular_file(folder / (std::string("images") + extension), error);
}

bool HoldsModel(const fs::path& folder) { return HoldsModel(folder, ".bin") || HoldsModel(folder, ".txt"); }

// As its file says, without reading it all; 0 where it says nothing sensible, which who reads it will tell.
std::uint64_t CountImages(const fs::path& model) try {
  if (HoldsModel(model, ".bin")) {
    std::uint64_t count = 0;
    std::array<unsigned char, 8> bytes = {};
    std::ifstream in = OpenToRead(model / "images.bin");
    in.read(reinterpret_cast<char*>(bytes.data()), bytes.size());
    if (in)
      for (std::size_t i = bytes.size(); i-- > 0;) count = count << 8 | bytes[i];
    return count;
  }
  const std::string text = ReadText(model / "images.txt");
  std::uint64_t lines = 0;
  for (std::size_t at = 0; at < text.size(); at = std::min(text.find('\n', at), text.size() - 1) + 1)
    lines += text[at] != '#' ? 1 : 0;
  return lines / 2;  // an image's pose, and its points
} catch (const InputError&) {
  return 0;
}

}  // namespace

std::vector<ColmapModelFolder> FindColmapModels(const fs::path& folder) {
  for (const fs::path& candidate : {folder, folder / "sparse"})
    if (HoldsModel(candidate)) return {{candidate, CountImages(candidate)}};
  // COLMAP numbers models as it finishes them, whatever their size.
  std::vector<ColmapModelFolder> models;
  for (const fs::path& parent : {folder / "sparse", folder}) {
    std::error_code error;
    for (fs::directory_iterator it(parent, error), end; !error && it != end; it.increment(error)) {
      const std::string name = it->path().filename().string();
      if (std::ranges::all_of(name, [](char c) { return c >= '0' && c <= '9'; }) && HoldsModel(it->path()))
        models.push_back({it->path(), CountImages(it->path())});
    }
    if (!models.empty()) break;
  }
  std::ranges::sort(models, [](const ColmapModelFolder& a, const ColmapModelFolder& b) {
    const auto number = [](const fs::path& path) {
      return std::pair(path.filename().string().size(), path.filename());
    };
    return a.images != b.images ? a.images > b.images : number(a.path) < number(b.path);
  });
  return models;
}

std::optional<fs::path> FindColmapModel(const fs::path& folder) {
  const std::vector<ColmapModelFolder> models = FindColmapModels(folder);
  return models.empty() ? std::nullopt : std::optional(models.front().path);
}

Scene ReadColmapModel(const fs::path& folder) {
  const bool binary = HoldsModel(folder, ".bin");
  if (!binary && !HoldsModel(folder, ".txt"))
    throw InputError(folder, "holds no COLMAP model (cameras and images, .bin or .txt)");
  const char* extension = binary ? ".bin" : ".txt";
  const auto file = [&](const char* stem) { return folder / (std::string(stem) + extension); };
  RawModel model;
  std::error_code error;
  model.has_points_file = fs::exists(file("points3D"), error);
  if (binary) {
    ReadCamerasBinary(file("cameras"), model);
    ReadImagesBinary(file("images"), model);
    if (model.has_points_file) ReadPointsBinary(file("points3D"), model);
  } else {
    ReadCamerasText(file("cameras"), model);
    ReadImagesText(file("images"), model);
    if (model.has_points_file) ReadPointsText(file("points3D"), model);
  }
  if (model.images.empty()) throw InputError(file("images"), "the model has no images");
  Scene scene = ToScene(file("images"), std::move(model));
  scene.folder = folder;
  return scene;
}

void WriteColmapModel(const Scene& scene, const fs::path& folder, ColmapFormat format) {
  if (scene.frame != Frame::kMetric)
    throw DataError(fmt::format("a {} scene has no cameras that COLMAP could hold", Name(scene.frame)),
                    "make it again with known intrinsics: lumi-reconstruct --camera camera.yaml", folder);
  for (const Camera& camera : scene.cameras)
    if (camera.model == CameraModel::kPlumbBob)
      throw std::invalid_argument("WriteColmapModel: a camera has skew and k3");
  for (const View& v : scene.views)
    if (v.camera.value < 0 || static_cast<std::size_t>(v.camera.value) >= scene.cameras.size())
      throw std::invalid_argument("WriteColmapModel: view " + v.name + " has no camera");
  const Tracks tracks = ListFeatures(scene);
  if (format == ColmapFormat::kBinary)
    WriteBinary(scene, tracks, folder);
  else
    WriteText(scene, tracks, folder);
  // What an earlier model left in the other format, or newer COLMAPs' rigs, would contradict these files.
  std::error_code ignored;
  const char* other = format == ColmapFormat::kBinary ? ".txt" : ".bin";
  for (const char* stem : {"cameras", "images", "points3D"}) fs::remove(folder / (std::string(stem) + other), ignored);
  for (const char* stem : {"rigs", "frames"})
    for (const char* extension : {".bin", ".txt"}) fs::remove(folder / (std::string(stem) + extension), ignored);
}

}  // namespace lumi
