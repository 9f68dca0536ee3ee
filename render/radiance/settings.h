// How radiance is reconstructed at a ray: the options of lumi-render that the weights depend on.
#pragma once

#include <string>

namespace lumi {

struct RadianceSettings {
  int k = 4;                   // cameras a pixel blends; 0: all
  double gamma = 1.0;          // weight of the field-of-view penalty; 0 lets a camera count up to its very border
  double fov_feather = 0.05;   // width of the border over which a photo fades, fraction of its smaller side, (0, 0.5]
  bool visibility = true;      // photos whose view of a point the proxy blocks rank last
  bool prefilter = true;       // oversampled photos are read from their pyramid
};

// Empty, or what is wrong, naming the option.
std::string Validate(const RadianceSettings& settings);

// The most cameras a pixel may blend where k is not "all".
constexpr int kMaxBlend = 16;

// A photo whose field-of-view value lies below this fades out of the alpha of a pixel that no other photo covers.
constexpr float kAlphaFullAt = 0.05F;

}  // namespace lumi
