// Right files of every format that has a fuzz target: what mutation starts from.
#pragma once

#include <filesystem>

#include "scene/model/scene.h"

namespace lumi::fuzz {

// Three views of two cameras (one with distortion), six points with their tracks; without photos.
const Scene& SeedScene();

// out/TARGET/NAME for every target. The capture's own files (manifest, provenance, photos) and all that can be written
// of its views and points, of few of them: a small input is mutated more often. Formats that a capture does not have
// (poses, times, rules) are written by hand.
void WriteSeeds(const std::filesystem::path& capture, const std::filesystem::path& out);

}  // namespace lumi::fuzz
