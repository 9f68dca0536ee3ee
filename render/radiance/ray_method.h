// A way of choosing and weighing photos at the rays of one view other than this core's own: published methods are
// compared with it through this (render/comparators/). Made for one view; whoever makes it puts it into the ViewSetup.
#pragma once

#include "render/radiance/rays.h"
#include "render/radiance/visibility.h"

namespace lumi {

struct ViewSetup;

class RayMethod {
 public:
  virtual ~RayMethod() = default;
  // A method with its own surface in place of the proxy moves t, normal and face to it. Thread-safe, as is Weigh.
  virtual void Meet(RaySamples&) const {}
  // Replaces `table`. Rays have t, normal and face; setup is the one of the view that the method was made for.
  virtual void Weigh(const ViewSetup& setup, const VisibilityMaps* visibility, const RaySamples& rays,
                     WeightTable& table) const = 0;
};

}  // namespace lumi
