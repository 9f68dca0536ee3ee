#include "export/held_photos.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>

#include "render/photos/photo_cache.h"
#include "render/photos/photo_set.h"
#include "scene/program/memory.h"

namespace lumi {

int HalvingsToHold(const Scene& scene, double most_pixels, double copies, ProgressSink& sink) {
  constexpr double kShare = 0.6;      // of the free memory, as for rendering
  constexpr int kLeastLongest = 512;  // a smaller photo shows nothing of a scene
  int longest = 1;
  for (const View& view : scene.views) longest = std::max(longest, SizePx(scene, view).maxCoeff());
  const auto pixels = [&](int halved) {
    double sum = 0;
    for (const View& view : scene.views) sum += HalvedSize(SizePx(scene, view), halved).cast<double>().prod();
    return sum;
  };
  int halvings = 0;
  while (most_pixels > 0 && pixels(halvings) > most_pixels && longest >> (halvings + 1) >= kLeastLongest) ++halvings;
  const auto bytes = [&](int halved) {
    double sum = 0;
    for (const View& view : scene.views)
      sum += static_cast<double>(PhotoCache::BytesOf(HalvedSize(SizePx(scene, view), halved)));
    return copies * sum;
  };
  const double room = kShare * static_cast<double>(AvailableMemory());
  const int wanted = halvings;
  while (bytes(halvings) > room && longest >> (halvings + 1) >= kLeastLongest) ++halvings;
  if (halvings > wanted)
    sink.Message(fmt::format("{} photos would take {:.1f} GB of memory, and {:.1f} GB may be used: they are halved{}",
                             scene.views.size(), bytes(wanted) / 1e9, room / 1e9,
                             halvings - wanted > 1 ? fmt::format(" {} times", halvings - wanted) : ""));
  if (bytes(halvings) > room)
    RequireMemory(static_cast<std::uint64_t>(bytes(halvings) / kShare), scene.folder,
                  "use a larger machine, or a scene of fewer photos");
  return halvings;
}

}  // namespace lumi
