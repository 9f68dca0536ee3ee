// Embree 3 and 4 behind one door: to a query, 3 wants a context, 4 takes arguments, which may be left out.
#pragma once

#if LUMI_EMBREE_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <new>

#include "scene/program/error.h"

namespace lumi::embree {

// To be called after what makes something of a device: a call that fails returns null or does nothing, and leaves its
// reason with the device (null: one that could not be made). Throws std::bad_alloc or MachineError.
inline void Require(RTCDevice device, const void* made) {
  const RTCError error = rtcGetDeviceError(device);
  if (error == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
  if (error != RTC_ERROR_NONE || !made) throw MachineError("Embree cannot trace rays on this machine");
}

#if LUMI_EMBREE_MAJOR >= 4
inline void Intersect(RTCScene scene, RTCRayHit& query) { rtcIntersect1(scene, &query, nullptr); }
inline void Occluded(RTCScene scene, RTCRay& query) { rtcOccluded1(scene, &query, nullptr); }
// Rays that start and go alike.
inline void IntersectCoherent(const int* valid, RTCScene scene, RTCRayHit16& packet) {
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcIntersect16(valid, scene, &packet, &arguments);
}
#else
inline RTCIntersectContext Context(RTCIntersectContextFlags flags) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = flags;
  return context;
}
inline void Intersect(RTCScene scene, RTCRayHit& query) {
  RTCIntersectContext context = Context(RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT);
  rtcIntersect1(scene, &context, &query);
}
inline void Occluded(RTCScene scene, RTCRay& query) {
  RTCIntersectContext context = Context(RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT);
  rtcOccluded1(scene, &context, &query);
}
inline void IntersectCoherent(const int* valid, RTCScene scene, RTCRayHit16& packet) {
  RTCIntersectContext context = Context(RTC_INTERSECT_CONTEXT_FLAG_COHERENT);
  rtcIntersect16(valid, scene, &context, &packet);
}
#endif

}  // namespace lumi::embree
