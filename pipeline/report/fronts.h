// What accuracy costs at each stage of a scene, as one picture: the tables that its stages' --tradeoff left in
// SCENE/tradeoff, and the renderer's fronts in SCENE/fronts.
#pragma once

#include <filesystem>
#include <string>

namespace lumi {

// A panel a stage: its settings, the front as steps, and the one that the scene was made with. `film`: the name of the
// settings that the fly-through was rendered with; empty: none. Empty where no stage has measured; a file that cannot
// be read is left out.
std::string FrontsSvg(const std::filesystem::path& scene_folder, const std::string& film);

}  // namespace lumi
