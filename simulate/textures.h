// Colour of a surface at a place: procedural patterns with detail enough for feature detectors, or a picture.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "simulate/scene_description.h"

namespace lumi {

struct SurfacePlace {
  Eigen::Vector3f x_in_object = Eigen::Vector3f::Zero();  // solid patterns (noise, wood) live here
  Eigen::Vector2f uv = Eigen::Vector2f::Zero();           // the others here; world units
  float footprint = 0;  // width of the area that is averaged, world units: detail finer than this is left out
};

class Texture {
 public:
  explicit Texture(const TextureDescription& description);  // loads the picture; throws InputError
  Rgb At(const SurfacePlace& place) const;

 private:
  struct Level {  // of the picture's pyramid, linear light
    int width = 0, height = 0;
    std::vector<Rgb> pixels;
  };
  Rgb Palette(float t) const;          // smooth, t in [0, 1]
  Rgb Pick(std::uint32_t bits) const;  // one of the colours, varied in brightness
  Rgb Noise(const SurfacePlace& place) const;
  Rgb Cells(const SurfacePlace& place) const;
  Rgb Bricks(const SurfacePlace& place, bool shifted_rows) const;
  Rgb Stripes(const SurfacePlace& place) const;
  Rgb Wood(const SurfacePlace& place) const;
  Rgb Glyphs(const SurfacePlace& place) const;
  Rgb Picture(const SurfacePlace& place) const;
  Rgb Checker(const SurfacePlace& place) const;

  TextureDescription d_;
  std::shared_ptr<const std::vector<Level>> pyramid_;
};

}  // namespace lumi
