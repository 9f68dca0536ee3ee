// What accuracy costs at each stage of a scene, as one picture: the tables that its stages' --tradeoff left in
// SCENE/tradeoff, the renderer's fronts in SCENE/fronts, and the film's whose window the scene is.
#pragma once

#include <filesystem>
#include <string>

namespace lumi {

// What is marked in the panels.
struct SceneSettings {
  std::string quality;  // the scene's folder, where lumi-pipeline --tradeoff made it
  std::string proxy;    // the active one
  std::string film;     // name of the settings that the fly-through was rendered with; empty: none
};

// A panel a stage: its settings, the front as steps; marked are the settings that the stage measured from ("as given"),
// and the film's and the quality that are this scene's. Empty where no stage has measured; a file that cannot be read
// is left out.
std::string FrontsSvg(const std::filesystem::path& scene_folder, const SceneSettings& scene);

}  // namespace lumi
