// The view at rest by optimal weights at every pixel (thesis ch. 4): drawn on the CPU, on a thread of its own, and
// given up as soon as anything else is wanted. Its inputs are copied, or shared and never changed: nothing is loaded
// twice, and no lock is held while it is drawn.
#pragma once

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "render/photos/photo_set.h"
#include "render/radiance/proxy_tracer.h"
#include "render/radiance/settings.h"
#include "render/radiance/sources.h"
#include "render/radiance/visibility.h"
#include "render/world/renderer.h"

namespace lumi {

// These settings with the optimum at every pixel, as lumi-render takes them with --similarity full --grid pixel.
RadianceSettings OptimalSettings(const RadianceSettings& settings);

struct Refinement {
  RenderRequest request;  // settings without a grid; show: colour or false colour
  Sources sources;
  std::shared_ptr<const ProxyTracer> proxy;          // in the sources' normalised frame
  std::shared_ptr<const VisibilityMaps> visibility;  // nullptr or empty: the proxy hides nothing
  std::shared_ptr<const std::vector<Photo>> photos;  // one a source; those without levels are left out
};

struct RefinedPicture {
  ImageF image;         // as Renderer::Render gives it
  double seconds = 0;   // from when it was begun
  std::string problem;  // why there is none
};

class Refiner {
 public:
  Refiner();
  ~Refiner();  // abandons the picture that is being drawn
  Refiner(const Refiner&) = delete;
  Refiner& operator=(const Refiner&) = delete;

  // Both return at once; threads stop drawing the earlier picture after their current tile.
  void Start(Refinement wanted);
  void Cancel();
  // Started, and neither taken nor cancelled.
  bool busy() const;
  double fraction() const;  // of the picture that is being drawn
  // The picture that was started last, once it is whole. Never one that was cancelled.
  std::optional<RefinedPicture> Take();

 private:
  void Work();
  RefinedPicture Draw(const Refinement& wanted, long number);

  mutable std::mutex mutex_;
  std::condition_variable more_;
  std::optional<Refinement> next_;
  std::optional<RefinedPicture> done_;
  bool busy_ = false, stop_ = false;
  std::atomic<long> number_ = 0;  // of the wanted picture: threads drawing another stop. Changed under the lock only
  std::atomic<int> tiles_ = 0, tiles_drawn_ = 0;
  std::thread thread_;  // last: it uses all of the above
};

}  // namespace lumi
