// Cameras, paths, light, background and effects.
#include <cmath>

#include "scene/geometry/angle.h"
#include "simulate/camera_paths.h"
#include "simulate/parse_parts.h"

namespace lumi {
namespace {

using Range = JsonReader::Range;

int CameraByName(JsonReader& reader, const nlohmann::json& value, const ParseContext& context, const std::string& key) {
  const auto& cameras = context.scene->cameras;
  if (value.is_string()) {
    for (std::size_t i = 0; i < cameras.size(); ++i)
      if (cameras[i].name == value.get<std::string>()) return static_cast<int>(i);
    reader.Fail(key, "there is no camera \"" + value.get<std::string>() + "\"");
  }
  reader.Fail(key, "must be the name of a camera");
}

void ParseRing(JsonReader& reader, PathDescription& path, double arc_deg) {
  path.kind = PathKind::kRing;
  path.centre = reader.Vector3("centre", path.centre);
  path.radius = reader.RequireNumber("radius", Range::kPositive);
  path.height = reader.Number("height", 0);
  path.start_rad = reader.Number("start_deg", 0) * kRadPerDeg;
  path.arc_rad = reader.Number("arc_deg", arc_deg, Range::kPositive) * kRadPerDeg;
  if (!path.look_at) path.look_at = path.centre;
}

void ParseGait(JsonReader& reader, const ParseContext& context, PathDescription& path) {
  const auto* node = reader.Find("gait");
  if (node == nullptr) return;
  JsonReader gait(*node, context.name, reader.Place("gait"));
  path.step_hz = gait.Number("step_hz", path.step_hz, Range::kPositive);
  path.bob = gait.Number("bob", path.bob, Range::kNotNegative);
  path.sway = gait.Number("sway", path.sway, Range::kNotNegative);
  path.shake_rad = gait.Number("shake_deg", path.shake_rad * kDegPerRad, Range::kNotNegative) * kRadPerDeg;
  path.pace_s = gait.Number("pace_s", path.pace_s, Range::kNotNegative);
  path.zoom_error = 0.01 * gait.Number("zoom_percent", 0, Range::kNotNegative);
  if (path.zoom_error >= 0.5) gait.Fail("zoom_percent", "must be < 50");
  gait.Done();
  path.gait = true;
}

void ParseFromTo(JsonReader& reader, PathDescription& path) {
  path.from = reader.RequireVector3("from");
  path.to = reader.RequireVector3("to");
  if (!((path.to - path.from).norm() > 0)) reader.Fail("to", "must differ from \"from\"");
}

}  // namespace

CameraDescription ParseCamera(const nlohmann::json& node, const ParseContext& context, const std::string& place) {
  JsonReader reader(node, context.name, place);
  CameraDescription description;
  description.name = reader.Text("name", "");
  Camera& camera = description.camera;
  const std::string model = reader.Text("model", "PINHOLE");
  const auto known = CameraModelFromName(model);
  if (!known) reader.Fail("model", "\"" + model + "\" is not a camera model known here (PINHOLE, OPENCV, ...)");
  camera.model = *known;
  const auto size = reader.Numbers("size", 2);
  for (const double n : size)
    if (!(n >= 1 && n <= 20000 && n == std::floor(n)))
      reader.Fail("size", "must be whole numbers of pixels, 1 to 20000");
  camera.width_px = static_cast<int>(size[0]);
  camera.height_px = static_cast<int>(size[1]);
  const auto count = static_cast<std::size_t>(ParameterCount(camera.model));
  if (reader.Has("params")) {
    if (reader.Has("fov_deg")) reader.Fail("fov_deg", "give params or fov_deg, not both");
    camera.params = reader.Numbers("params", count);
  } else {
    const double fov_deg = reader.RequireNumber("fov_deg", Range::kPositive);
    if (fov_deg >= 179) reader.Fail("fov_deg", "must be < 179");
    const double half = 0.5 * fov_deg * kRadPerDeg;
    const bool fisheye = camera.model == CameraModel::kOpenCVFisheye;
    const double focal_px = 0.5 * camera.width_px / (fisheye ? half : std::tan(half));
    camera.params.assign(count, 0.0);
    camera = camera.WithPinhole({focal_px, focal_px}, {0.5 * camera.width_px, 0.5 * camera.height_px});
    if (reader.Has("distortion")) {
      const auto terms =
          reader.Numbers("distortion", count - static_cast<std::size_t>(InfoOf(camera.model).FocalCount()) - 2);
      std::ranges::copy(terms, camera.params.end() - static_cast<std::ptrdiff_t>(terms.size()));
    }
  }
  if (const auto wrong = Validate(camera)) reader.Fail(*wrong);
  reader.Done();
  return description;
}

PathDescription ParsePath(const nlohmann::json& node, const ParseContext& context, const std::string& place) {
  JsonReader reader(node, context.name, place);
  PathDescription path;
  const std::string kind = reader.RequireText("kind");
  if (reader.Has("look_at")) path.look_at = reader.RequireVector3("look_at");
  path.views = reader.Integer("views", 1, 1, static_cast<int>(kMostViews));
  bool moving = false;
  if (kind == "ring") {
    ParseRing(reader, path, 360);
  } else if (kind == "half-circle") {
    ParseRing(reader, path, 180);
  } else if (kind == "grid") {
    path.kind = PathKind::kGrid;
    path.centre = reader.RequireVector3("centre");
    path.columns = reader.Integer("columns", 1, 1, 10000);
    path.rows = reader.Integer("rows", 1, 1, 10000);
    path.spacing = reader.Vector2("spacing", path.spacing);
    path.views = path.columns * path.rows;
    if (static_cast<std::size_t>(path.views) > kMostViews)
      reader.Fail("rows", "times columns must be at most " + std::to_string(kMostViews));
  } else if (kind == "walk" || kind == "drive") {
    path.kind = kind == "walk" ? PathKind::kWalk : PathKind::kDrive;
    ParseFromTo(reader, path);
    path.direction = path.to - path.from;
    moving = true;
    path.gait = path.kind == PathKind::kWalk;
    ParseGait(reader, context, path);
    if (path.kind == PathKind::kDrive) path.weave = reader.Number("weave", 0, Range::kNotNegative);
  } else if (kind == "wave") {
    path.kind = PathKind::kWave;
    path.centre = reader.RequireVector3("centre");
    path.amplitude = reader.Vector3("amplitude", path.amplitude);
    path.period_s = reader.Number("period_s", path.period_s, Range::kPositive);
    if (const auto* node_of_hand = reader.Find("hand"); node_of_hand != nullptr) {
      JsonReader hand(*node_of_hand, context.name, reader.Place("hand"));
      path.hand_drift = hand.Number("drift", 0, Range::kNotNegative);
      path.hand_rad = hand.Number("shake_deg", 0, Range::kNotNegative) * kRadPerDeg;
      hand.Done();
    }
    moving = true;
  } else if (kind == "clusters") {
    path.kind = PathKind::kClusters;
    for (const auto& [element, where] : reader.Array("centres")) {
      const nlohmann::json holder{{"at", *element}};
      path.centres.push_back(JsonReader(holder, context.name, where).RequireVector3("at"));
    }
    if (path.centres.empty()) reader.Fail("centres", "needs at least one");
    path.spread = reader.Number("spread", path.spread, Range::kNotNegative);
  } else if (kind == "poses") {
    path.kind = PathKind::kPoses;
    for (const auto& [element, where] : reader.Array("poses")) {
      JsonReader pose(*element, context.name, where);
      const Eigen::Vector3d eye = pose.RequireVector3("eye");
      const Eigen::Vector3d target = pose.RequireVector3("target");
      if (!((target - eye).norm() > 0)) pose.Fail("target", "must differ from the eye");
      path.poses.emplace_back(eye, target);
      pose.Done();
    }
    if (path.poses.empty()) reader.Fail("poses", "needs at least one");
    path.views = static_cast<int>(path.poses.size());
  } else {
    reader.Fail("kind", "\"" + kind + "\" is not one of ring, half-circle, grid, walk, drive, wave, clusters, poses");
  }
  path.direction = reader.Vector3("direction", path.direction);
  if (!(path.direction.norm() > 0)) reader.Fail("direction", "must not be zero");
  path.fps = reader.Number("fps", moving ? 30 : 1, Range::kPositive);
  path.zoom = reader.Vector2("zoom", path.zoom);
  if (!(path.zoom.minCoeff() > 0)) reader.Fail("zoom", "must be > 0");
  if (reader.Has("hold")) {
    path.hold = reader.RequireVector3("hold");
    const PathDescription ideal = WithShake(path, 0);
    for (int i = 0; i < path.views; ++i)
      if (!((PoseAt(ideal, i) * *path.hold).z() > 0))
        reader.Fail("hold", "must be in front of the camera all along the path");
  }
  if (const auto* camera = reader.Find("camera"); camera != nullptr) {
    path.cameras.clear();
    if (camera->is_array()) {
      for (const auto& [value, unused] : reader.Array("camera"))
        path.cameras.push_back(CameraByName(reader, *value, context, "camera"));
      if (path.cameras.empty()) reader.Fail("camera", "needs at least one");
    } else {
      path.cameras = {CameraByName(reader, *camera, context, "camera")};
    }
  }
  reader.Done();
  return path;
}

LightDescription ParseLight(const nlohmann::json& node, const ParseContext& context, const std::string& place) {
  JsonReader reader(node, context.name, place);
  LightDescription light;
  light.directional = !reader.Has("position");
  if (light.directional) {
    light.towards = reader.RequireVector3("towards");
    if (!(light.towards.norm() > 0)) reader.Fail("towards", "must not be zero");
    light.towards.normalize();
    light.size_rad = reader.Number("size_deg", 0, Range::kNotNegative) * kRadPerDeg;
  } else {
    light.towards = reader.RequireVector3("position");
    light.reach = reader.Number("reach", 0, Range::kNotNegative);
  }
  light.color =
      ParseColor(reader, "color", light.color) * static_cast<float>(reader.Number("strength", 1, Range::kNotNegative));
  light.shadows = reader.Flag("shadows", true);
  reader.Done();
  return light;
}

BackgroundDescription ParseBackground(const nlohmann::json& node, const ParseContext& context,
                                      const std::string& place) {
  JsonReader reader(node, context.name, place);
  BackgroundDescription background;
  if (reader.Has("texture")) {
    background.kind = BackgroundKind::kTexture;
    background.texture = ParseTexture(reader.Require("texture"), context, reader.Place("texture"));
  } else if (reader.Has("zenith")) {
    background.kind = BackgroundKind::kGradient;
    background.zenith = ParseColor(reader, "zenith", background.zenith);
    background.horizon = ParseColor(reader, "horizon", background.zenith);
    background.ground = ParseColor(reader, "ground", background.horizon);
  } else {
    background.horizon = ParseColor(reader, "color", background.horizon);
  }
  reader.Done();
  return background;
}

FixedVideoDescription ParseFixedVideo(const nlohmann::json& node, const ParseContext& context,
                                      const std::string& place) {
  JsonReader reader(node, context.name, place);
  FixedVideoDescription fixed;
  fixed.eye = reader.RequireVector3("eye");
  fixed.target = reader.RequireVector3("target");
  if (!((fixed.target - fixed.eye).norm() > 0)) reader.Fail("target", "must differ from the eye");
  fixed.frames = reader.Integer("frames", 300, 1, 1000000);
  fixed.start_frame = reader.Integer("start_frame", 0, 0, 1000000);
  reader.Done();
  return fixed;
}

EffectsDescription ParseEffects(const nlohmann::json& node, const ParseContext& context, const std::string& place) {
  JsonReader reader(node, context.name, place);
  EffectsDescription effects;
  // Zero is "off": the code of an effect that does nothing is not entered.
  const auto read = [&](const std::string& key, std::optional<double>& effect, Range range) {
    const double value = reader.Number(key, 0, range);
    if (value != 0) effect = value;
  };
  read("skew_px", effects.skew_px, Range::kAny);
  read("noise_sigma", effects.noise_sigma, Range::kNotNegative);
  read("motion_blur_s", effects.motion_blur_s, Range::kNotNegative);
  effects.motion_blur_every = reader.Integer("motion_blur_every", 1, 1);
  read("rolling_shutter_s", effects.rolling_shutter_s, Range::kNotNegative);
  read("exposure_stops", effects.exposure_stops, Range::kNotNegative);
  effects.exposure_period_s = reader.Number("exposure_period_s", 10, Range::kPositive);
  read("white_balance_stops", effects.white_balance_stops, Range::kNotNegative);
  effects.white_balance_period_s = reader.Number("white_balance_period_s", 10, Range::kPositive);
  read("vignetting", effects.vignetting, Range::kNotNegative);
  if (effects.vignetting && *effects.vignetting > 1) reader.Fail("vignetting", "must be <= 1");
  reader.Done();
  return effects;
}

}  // namespace lumi
