// Camera paths of ours and of nerfstudio's viewer: frames and keyframes, then the pictures' cameras along them.
#include <cmath>

#include "render/path/camera_path.h"
#include "tests/fuzz/fuzz_target.h"

namespace lumi::fuzz {

LUMI_FUZZ_TARGET(camera_path) {
  const std::filesystem::path file = InputFile("path.json", bytes);
  for (const PathDetail detail : {PathDetail::kFrames, PathDetail::kKeyframes}) {
    const CameraPath path = ReadCameraPath(file, detail);
    Require(!path.keys.empty() && Duration(path) >= 0 && Duration(path) <= kMaxPathSeconds, "a path of nothing");
    Require(FrameCount(path) >= 1 && FrameCount(path) <= 100'000'000, "more frames than a day has");
    for (const double t : {0.0, 0.3, 0.5, 1.0}) {
      const PathKey pose = PoseOnPath(path, path.keys.front().time_s + t * Duration(path));
      Require(pose.vertical_fov_rad > 0 && std::abs(pose.cam_from_world.rotation.norm() - 1) < 1e-6 &&
                  pose.cam_from_world.translation.allFinite(),
              "a pose between keys is none");
    }
  }
}

}  // namespace lumi::fuzz
