// Where the frames come from in which features are sought: any function, or photographs in a folder with their masks.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "scene/model/image.h"

namespace lumi {

struct FrameSource {
  std::vector<std::string> names;  // Tracks::Frame::name; one a frame
  // Frame i, RGB or grey (channels 3 or 1). Called once a frame; from several threads at once unless in_order.
  std::function<Image8(int)> image;
  // Optional: frame i's mask, below 128 = ignore (its first channel counts); of another size than the frame it is
  // scaled, as COLMAP does. An empty image: nothing is ignored. Called as image is.
  std::function<Image8(int)> mask;
  bool in_order = false;         // image and mask want 0, 1, 2 ... in turn, one call at a time (a video)
  std::filesystem::path folder;  // errors name folder / names[i]

  int count() const { return static_cast<int>(names.size()); }
};

// folder / name for each name; masks as COLMAP has them: mask_folder / (name + ".png"), black = ignore. A photo without
// a mask file is used whole; mask_folder may be empty.
FrameSource PhotoSource(const std::filesystem::path& folder, std::vector<std::string> names,
                        const std::filesystem::path& mask_folder = {});

namespace tracks_internal {
// Throws DataError naming the file where there are no pixels, or other than 1 or 3 channels.
struct FrameAndMask {
  Image8 image;
  Image8 mask;  // one channel of the frame's size, 0 or 255; empty: nothing is ignored
};
FrameAndMask LoadFrame(const FrameSource& source, int frame);
}  // namespace tracks_internal

}  // namespace lumi
