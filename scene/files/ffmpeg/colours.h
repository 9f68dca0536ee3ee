// What the colours of a decoded frame are.
#pragma once

#include "scene/files/ffmpeg/owners.h"

extern "C" {
#include <libavutil/pixdesc.h>
}

namespace lumi::ffmpeg {

// What the colours of a frame are: its own words, or the standard's default.
struct Colours {
  int width = 0, height = 0;
  AVPixelFormat format = AV_PIX_FMT_NONE;
  AVColorSpace matrix = AVCOL_SPC_UNSPECIFIED;
  AVColorTransferCharacteristic transfer = AVCOL_TRC_UNSPECIFIED;
  AVColorPrimaries primaries = AVCOL_PRI_UNSPECIFIED;
  AVChromaLocation chroma = AVCHROMA_LOC_UNSPECIFIED;
  bool full_range = false;
  bool Hdr() const { return transfer == AVCOL_TRC_SMPTE2084 || transfer == AVCOL_TRC_ARIB_STD_B67; }
  bool operator==(const Colours&) const = default;
};
Colours ColoursOf(const AVFrame& frame);

const AVPixFmtDescriptor& Descriptor(AVPixelFormat format);
bool IsRgb(AVPixelFormat format);
bool IsGrey(AVPixelFormat format);

}  // namespace lumi::ffmpeg
