// Photos made smaller for a web page: fewer, narrower, or coarser JPEGs; which of these is best for the megabytes is
// what held-out photos say, rendered from the reduced ones and compared with the originals.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "export/web_export.h"
#include "render/lumigraph/lumigraph.h"

namespace lumi {

// A photo as the page has it.
struct PagePhoto {
  std::string jpeg;
  bool own = false;  // the photo's own file
  Eigen::Vector2i size_px;
};

// A scene's photos reduced: the views that are left, with cameras for the smaller photos, and the photos themselves.
struct ReducedPhotos {
  PhotoReduction reduction;
  Scene scene;
  std::vector<int> view;  // of the whole scene, one a photo left
  std::vector<PagePhoto> photos;
};

// max_bytes: of all JPEGs together, what the page's encoding makes of them included. Tries several reductions on the
// photos that things are chosen by (every 8th, from the 4th on), which are left out while they are judged; `tried`
// gets each. Throws DataError where not even the least that is tried fits.
ReducedPhotos ReduceFor(const Lumigraph& lumigraph, double max_bytes, int max_width_px, double bytes_a_byte,
                        std::vector<PhotoReduction>& tried, ProgressSink& sink);

ReducedPhotos Reduce(const Lumigraph& lumigraph, const PhotoReduction& reduction, ProgressSink& sink);

// Quality 0..100.
std::string EncodeJpeg(const Image8& image, int quality);
Image8 DecodeJpeg(const std::string& jpeg);

}  // namespace lumi
