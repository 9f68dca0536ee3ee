#include "scene/files/camera_yaml.h"
#include "tests/fuzz/fuzz_target.h"

namespace lumi::fuzz {

LUMI_FUZZ_TARGET(camera_yaml) {
  const std::filesystem::path file = InputFile("camera.yaml", bytes);
  Require(!Validate(ReadWholeCameraYaml(file).camera), "a camera that is none was accepted");
  Require(!Validate(ReadCameraYaml(file)), "a camera that is none was accepted");
}

}  // namespace lumi::fuzz
