// Radiance that a ray brings back: lambertian surfaces under fixed light, highlights (Blinn and Phong) and mirrored
// surroundings, both of which change with the viewing direction. Random numbers depend on the place alone, so that a
// surface looks the same from one view to the next wherever it should.
#pragma once

#include <vector>

#include "simulate/scene_description.h"
#include "simulate/textures.h"
#include "simulate/tracer.h"

namespace lumi {

class Shader {
 public:
  Shader(const SceneDescription& scene, const Tracer& tracer);

  struct Query {
    Ray ray;
    double pixel_angle = 0;  // angle that one sample stands for, radians
    int sample = 0;          // which of `samples`: picks the point of a light that has a size
    int samples = 1;
    std::uint32_t random = 0;  // for rough mirrors
    const PartPoses* parts = nullptr;
  };
  // Counts the rays that were traced.
  Rgb Radiance(const Query& query, long& rays) const;
  // Of a surface, as far as it does not depend on the direction.
  Rgb DiffuseColor(const Hit& hit, const PartPoses& parts, long& rays) const;

 private:
  // The background, or for mirrors (depth > 0) the environment where there is one.
  Rgb Background(const Eigen::Vector3d& direction, double pixel_angle, int depth) const;
  struct Illumination {
    Rgb diffuse, highlight;
  };
  Illumination Illuminate(const Query& query, const Hit& hit, long& rays) const;
  Rgb Albedo(const Hit& hit, float footprint) const;
  Rgb Trace(const Query& query, double distance_before, int depth, long& rays) const;
  Rgb Shade(const Query& query, const Hit& hit, double distance, int depth, long& rays) const;

  const SceneDescription& scene_;
  const Tracer& tracer_;
  std::vector<Texture> textures_;                          // of each material
  std::vector<std::vector<Eigen::Vector3d>> lamp_points_;  // of each light with a size: directions to its disc
  Texture dome_, environment_dome_;
};

}  // namespace lumi
