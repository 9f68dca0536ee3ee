// What the lumigraph's files share.
#pragma once

#include <epoxy/gl.h>

#include "render/gl/photo_textures.h"

namespace lumi {

// Textures of different types that no shader reads together share a unit.
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
