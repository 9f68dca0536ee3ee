// What the lumigraph's files share.
#pragma once

#include <epoxy/gl.h>

#include "render/gl/photo_textures.h"

namespace lumi {

// What no shader reads at once, and is of another kind, shares a unit.
enum TextureUnit {
  kDepthUnit,
  kPlaceUnit,
  kFaceUnit,
  kCameraUnit,
  kVisibilityUnit,
  kListUnit,
  kFieldUnit,
  kFirstPhotoUnit,
  kProjectionUnit = kVisibilityUnit,
  kRecordUnit = kDepthUnit,
  kColorUnit = kFirstPhotoUnit
};
static_assert(kFirstPhotoUnit == kReservedTextureUnits);

constexpr int kFloatsPerRow = 4;  // of a camera's

}  // namespace lumi
