// The error of left-out photos, by lumi-render, on a copy of a scene that shares its photos and cameras: its proxies
// and its manifest may be changed.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "scene/files/temporary_folder.h"

namespace lumi {

class HeldOutBench {
 public:
  // Every `holdout`-th photo is left out; measured on holdout / 2, holdout / 2 + holdout ..., in pictures of this
  // width.
  HeldOutBench(const std::filesystem::path& scene_folder, int holdout, int width_px);
  const std::filesystem::path& folder() const { return copy_.path(); }

  struct Figures {
    double psnr_db = 0, ms_per_frame = 0;
  };
  // Both throw Error with the program's message; Interrupted.
  Figures Measure(const std::string& proxy) const;
  void MakePlane() const;  // a proxy "plane" in the copy

 private:
  TemporaryFolder copy_;
  int holdout_, width_px_;
};

}  // namespace lumi
