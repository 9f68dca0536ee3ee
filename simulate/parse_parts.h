// The parts of a scene's JSON, one function each; scene_description.cc puts them together.
#pragma once

#include <string>

#include "simulate/json_reader.h"
#include "simulate/scene_description.h"

namespace lumi {

struct ParseContext {
  std::filesystem::path name;    // what messages name
  std::filesystem::path folder;  // relative paths are taken from here
  SceneDescription* scene;       // so far: cameras, textures and materials by name
};

// A colour as [r, g, b] (code values 0..1) or "#rrggbb", as light.
Rgb ParseColor(JsonReader& reader, const std::string& key, const Rgb& fallback);
TextureDescription ParseTexture(const nlohmann::json& node, const ParseContext& context, const std::string& place);
MaterialDescription ParseMaterial(const nlohmann::json& node, const ParseContext& context, const std::string& place);
ObjectDescription ParseObject(const nlohmann::json& node, const ParseContext& context, const std::string& place);
CameraDescription ParseCamera(const nlohmann::json& node, const ParseContext& context, const std::string& place);
PathDescription ParsePath(const nlohmann::json& node, const ParseContext& context, const std::string& place);
LightDescription ParseLight(const nlohmann::json& node, const ParseContext& context, const std::string& place);
BackgroundDescription ParseBackground(const nlohmann::json& node, const ParseContext& context,
                                      const std::string& place);
FixedVideoDescription ParseFixedVideo(const nlohmann::json& node, const ParseContext& context, const std::string& place);
EffectsDescription ParseEffects(const nlohmann::json& node, const ParseContext& context, const std::string& place);

}  // namespace lumi
