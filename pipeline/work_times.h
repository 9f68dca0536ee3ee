// How long a scene's stages took when they did their work: kept after each stage, so that a later run that reuses one
// can say so, also after a kill.
#pragma once

#include <filesystem>
#include <string>

#include "scene/files/json_keys.h"

namespace lumi {

struct WorkTime {
  double seconds = 0, colmap_seconds = 0;
};

// SCENE/provenance/pipeline-times.txt: STAGE -> {seconds, colmap_seconds}.
class WorkTimes {
 public:
  explicit WorkTimes(const std::filesystem::path& scene);
  WorkTime Of(const std::string& stage, const WorkTime& fallback) const;
  void Keep(const std::string& stage, const WorkTime& time);

 private:
  std::filesystem::path scene_, file_;
  JsonKeys times_;
};

}  // namespace lumi
