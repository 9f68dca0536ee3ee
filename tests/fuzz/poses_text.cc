// Lists of known cameras: Middlebury's, and twelve numbers a line in each meaning.
#include <cmath>

#include "reconstruct/poses_file.h"
#include "scene/program/error.h"
#include "tests/fuzz/fuzz_target.h"

namespace lumi::fuzz {

LUMI_FUZZ_TARGET(poses_text) {
  const std::filesystem::path file = InputFile("poses.txt", bytes);
  bool read = false;
  for (const PosesFormat format :
       {PosesFormat::kProjection, PosesFormat::kCamFromWorld, PosesFormat::kWorldFromCam, PosesFormat::kUnset}) {
    try {
      for (const PosedCamera& camera : ReadPosesFile(file, format)) {
        Require(!camera.K || camera.K->allFinite(), "K is not finite");
        Require(
            camera.cam_from_world.translation.allFinite() && std::abs(camera.cam_from_world.rotation.norm() - 1) < 1e-6,
            "a pose is none");
      }
      read = true;
    } catch (const Error&) {
      if (format == PosesFormat::kUnset && !read) throw;  // what none of them takes
    }
  }
}

}  // namespace lumi::fuzz
