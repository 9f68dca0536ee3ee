// Photos made smaller for a web page: fewer, narrower, or coarser JPEGs. The best reduction for the megabytes is the
// one with the lowest held-out error: held-out photos are rendered from the reduced ones and compared with the
// originals.
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

// max_bytes: of all JPEGs together, after the page's encoding. Tries several reductions and compares them on photos of
// the choosing fold (every 8th, from the 4th on), each of which is left out while it is judged; `tried` gets each
// reduction, with its megabytes. Throws DataError if not even the smallest one fits.
ReducedPhotos ReduceFor(const Lumigraph& lumigraph, double max_bytes, int max_width_px, double bytes_a_byte,
                        std::vector<PhotoReduction>& tried, ProgressSink& sink);

// Of photos with more pixels together no reduction at their full size fits into max_bytes: they may be held smaller.
double MostPixelsWithin(std::size_t photos, double max_bytes);

ReducedPhotos Reduce(const Lumigraph& lumigraph, const PhotoReduction& reduction, ProgressSink& sink);

// Quality 0..100.
std::string EncodeJpeg(const Image8& image, int quality);
Image8 DecodeJpeg(const std::string& jpeg);

}  // namespace lumi
