// Embree 3 and 4 behind one door: to a query, 3 wants a context, 4 takes arguments, which may be left out.
#pragma once

#include <type_traits>

#if LUMI_EMBREE_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace lumi::embree {

#if LUMI_EMBREE_MAJOR >= 4
inline void Intersect(RTCScene scene, RTCRayHit& query) { rtcIntersect1(scene, &query, nullptr); }
inline void Occluded(RTCScene scene, RTCRay& query) { rtcOccluded1(scene, &query, nullptr); }
// Rays that start and go alike, 4, 8 or 16 of them.
template <class Packet>
inline void IntersectCoherent(const int* valid, RTCScene scene, Packet& packet) {
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  if constexpr (std::is_same_v<Packet, RTCRayHit16>) rtcIntersect16(valid, scene, &packet, &arguments);
  if constexpr (std::is_same_v<Packet, RTCRayHit8>) rtcIntersect8(valid, scene, &packet, &arguments);
  if constexpr (std::is_same_v<Packet, RTCRayHit4>) rtcIntersect4(valid, scene, &packet, &arguments);
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
template <class Packet>
inline void IntersectCoherent(const int* valid, RTCScene scene, Packet& packet) {
  RTCIntersectContext context = Context(RTC_INTERSECT_CONTEXT_FLAG_COHERENT);
  if constexpr (std::is_same_v<Packet, RTCRayHit16>) rtcIntersect16(valid, scene, &context, &packet);
  if constexpr (std::is_same_v<Packet, RTCRayHit8>) rtcIntersect8(valid, scene, &context, &packet);
  if constexpr (std::is_same_v<Packet, RTCRayHit4>) rtcIntersect4(valid, scene, &context, &packet);
}
#endif

// The largest packet that this machine traverses at once; of larger ones Embree traces each ray by itself.
inline int PacketSize(RTCDevice device) {
  if (rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED)) return 16;
  return rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) ? 8 : 4;
}

}  // namespace lumi::embree
