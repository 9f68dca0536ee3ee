// The parts of a scene's JSON, one function each; scene_description.cc puts them together.
#pragma once

#include <string>

#include "simulate/json_reader.h"
#include "simulate/scene_description.h"

namespace lumi {

// Objects, groups and the sections of lofts, each with all its copies; and views of all paths. A few bytes of copies of
// copies must not ask for more than memory holds.
constexpr std::size_t kMostParts = 100000, kMostViews = 200000;
constexpr int kDeepestGroup = 32;

struct ParseContext {
  std::filesystem::path name;    // what messages name
  std::filesystem::path folder;  // relative paths are taken from here
  SceneDescription* scene;       // so far: cameras, textures and materials by name
  std::size_t* parts;            // so far, of kMostParts
};

// What a group hands on to its parts.
struct GroupDescription {
  Eigen::Affine3d world_from_group = Eigen::Affine3d::Identity();
  std::optional<bool> foreground;  // of parts that do not say
  std::optional<SpinDescription> spin;
  int depth = 0;
};

// A colour as [r, g, b] (code values 0..1) or "#rrggbb", as light.
Rgb ParseColor(JsonReader& reader, const std::string& key, const Rgb& fallback);
TextureDescription ParseTexture(const nlohmann::json& node, const ParseContext& context, const std::string& place);
MaterialDescription ParseMaterial(const nlohmann::json& node, const ParseContext& context, const std::string& place);
// Adds what the node describes to the scene: one object, its copies, or all that is in a group.
void ParseObject(const nlohmann::json& node, const ParseContext& context, const std::string& place,
                 const GroupDescription& group = {});
CameraDescription ParseCamera(const nlohmann::json& node, const ParseContext& context, const std::string& place);
PathDescription ParsePath(const nlohmann::json& node, const ParseContext& context, const std::string& place);
LightDescription ParseLight(const nlohmann::json& node, const ParseContext& context, const std::string& place);
BackgroundDescription ParseBackground(const nlohmann::json& node, const ParseContext& context,
                                      const std::string& place);
FixedVideoDescription ParseFixedVideo(const nlohmann::json& node, const ParseContext& context,
                                      const std::string& place);
EffectsDescription ParseEffects(const nlohmann::json& node, const ParseContext& context, const std::string& place);

}  // namespace lumi
