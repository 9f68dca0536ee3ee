#include "simulate/scene_description.h"

#include "scene/files/json_limits.h"
#include "scene/program/printable.h"
#include "simulate/parse_parts.h"

namespace lumi {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kLongestName = 200;  // in bytes; photos have a number and an ending more

Json ParseJson(const std::string& text, const std::filesystem::path& name) {
  if (const char* wrong = JsonBeyondLimits(text)) throw InputError(name, wrong);
  try {
    return Json::parse(text, nullptr, true, /*ignore_comments=*/true);
  } catch (const Json::parse_error& error) {
    std::size_t line = 1;
    for (std::size_t i = 0; i < std::min<std::size_t>(error.byte, text.size()); ++i) line += text[i] == '\n' ? 1 : 0;
    throw InputError(name, "line " + std::to_string(line) + ": this is not JSON",
                     "look for a missing comma, quote or bracket there");
  } catch (const Json::out_of_range& error) {
    // The only one that parsing throws: a number beyond a double's range, which the library quotes.
    const std::string said = error.what();
    throw InputError(name,
                     "a number is too large: " + Printable(said.substr(std::min(said.find('\''), said.size()), 40)));
  }
}

void ParseImage(JsonReader& root, const ParseContext& context) {
  const Json* node = root.Find("image");
  if (node == nullptr) return;
  JsonReader reader(*node, context.name, "image");
  const std::string format = reader.Text("format", "jpg");
  if (format != "jpg" && format != "png") reader.Fail("format", "must be \"jpg\" or \"png\"");
  context.scene->jpeg = format == "jpg";
  context.scene->jpeg_quality = reader.Integer("quality", 95, 1, 100);
  const int samples = reader.Integer("samples_per_pixel", 4, 1, 1024);
  int side = 1;
  while (side * side < samples) ++side;
  if (side * side != samples) reader.Fail("samples_per_pixel", "must be a square number (1, 4, 9, 16 ...)");
  context.scene->samples_per_pixel = samples;
  reader.Done();
}

void ParseAmbient(JsonReader& root, const ParseContext& context) {
  const Json* node = root.Find("ambient");
  if (node == nullptr) return;
  JsonReader reader(*node, context.name, "ambient");
  context.scene->ambient_sky = ParseColor(reader, "sky", context.scene->ambient_sky);
  context.scene->ambient_ground = ParseColor(reader, "ground", context.scene->ambient_sky * 0.6f);
  reader.Done();
}

}  // namespace

SceneDescription ParseScene(const std::string& json_text, const std::filesystem::path& name,
                            const std::filesystem::path& folder) {
  const Json json = ParseJson(json_text, name);
  if (!json.is_object()) throw InputError(name, "must be an object { ... }");
  SceneDescription scene;
  std::size_t parts = 0;
  const ParseContext context{name, folder, &scene, &parts};
  JsonReader root(json, name, "");
  scene.name = root.Text("name", name.stem().string());
  if (scene.name.empty() || scene.name.size() > kLongestName ||
      scene.name.find_first_of(std::string("/\0", 2)) != std::string::npos)
    root.Fail("name",
              "must be fit for a file's name: not empty, at most " + std::to_string(kLongestName) + " bytes, no slash");
  root.Text("description", "");
  ParseImage(root, context);
  for (const auto& [node, place] : root.Array("cameras")) scene.cameras.push_back(ParseCamera(*node, context, place));
  if (scene.cameras.empty()) root.Fail("cameras", "needs at least one camera");
  const Json& path = root.Require("path");
  std::size_t views = 0;
  const auto add_path = [&](const Json& node, const std::string& place) {
    scene.paths.push_back(ParsePath(node, context, place));
    views += static_cast<std::size_t>(scene.paths.back().views);
    if (views > kMostViews) root.Fail("path", "has more than " + std::to_string(kMostViews) + " views");
  };
  if (path.is_array()) {
    for (const auto& [node, place] : root.Array("path")) add_path(*node, place);
    if (scene.paths.empty()) root.Fail("path", "needs at least one path");
  } else {
    add_path(path, "path");
  }
  for (const auto& [node, place] : root.Array("materials")) {
    scene.materials.push_back(ParseMaterial(*node, context, place));
    for (std::size_t i = 0; i + 1 < scene.materials.size(); ++i)
      if (scene.materials[i].name == scene.materials.back().name)
        root.Fail("materials", "there are two named \"" + scene.materials[i].name + "\"");
  }
  for (const auto& [node, place] : root.Array("objects")) ParseObject(*node, context, place);
  for (const auto& [node, place] : root.Array("lights")) scene.lights.push_back(ParseLight(*node, context, place));
  ParseAmbient(root, context);
  if (root.Has("background")) scene.background = ParseBackground(root.Require("background"), context, "background");
  if (root.Has("environment")) scene.environment = ParseBackground(root.Require("environment"), context, "environment");
  if (root.Has("effects")) scene.effects = ParseEffects(root.Require("effects"), context, "effects");
  if (root.Has("period_s")) scene.period_s = root.RequireNumber("period_s", JsonReader::Range::kPositive);
  if (root.Has("fixed_video")) scene.fixed_video = ParseFixedVideo(root.Require("fixed_video"), context, "fixed_video");
  for (const auto& [node, place] : root.Array("videos")) scene.videos.push_back(ParseFixedVideo(*node, context, place));
  root.Done();
  return scene;
}

std::vector<std::string> EffectsOn(const SceneDescription& scene) {
  std::vector<std::string> names;
  bool distorted = false, moving = false;
  for (const CameraDescription& camera : scene.cameras) distorted = distorted || !camera.camera.IsPinhole();
  for (const ObjectDescription& object : scene.objects) moving = moving || object.spin.has_value();
  const EffectsDescription& effects = scene.effects;
  if (distorted) names.push_back("lens_distortion");
  if (effects.skew_px) names.push_back("skew");
  if (effects.noise_sigma) names.push_back("noise");
  if (effects.motion_blur_s) names.push_back("motion_blur");
  if (effects.rolling_shutter_s) names.push_back("rolling_shutter");
  if (effects.exposure_stops) names.push_back("exposure_drift");
  if (effects.white_balance_stops) names.push_back("white_balance_drift");
  if (effects.vignetting) names.push_back("vignetting");
  if (moving) names.push_back("moving_parts");
  return names;
}

}  // namespace lumi
