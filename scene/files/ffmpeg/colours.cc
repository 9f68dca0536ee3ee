#include "scene/files/ffmpeg/colours.h"

#include <cstring>
#include <type_traits>

namespace lumi::ffmpeg {
namespace {

// A file that names no matrix is taken for BT.709 from this size on and for BT.601 below it, as players do.
constexpr int kHdLines = 720, kHdColumns = 1280;

// The deprecated formats "of JPEG" are the usual ones in full range.
AVPixelFormat UsualFormat(int format, bool* full_range) {
  static constexpr AVPixelFormat kOfJpeg[][2] = {{AV_PIX_FMT_YUVJ420P, AV_PIX_FMT_YUV420P},
                                                 {AV_PIX_FMT_YUVJ422P, AV_PIX_FMT_YUV422P},
                                                 {AV_PIX_FMT_YUVJ444P, AV_PIX_FMT_YUV444P},
                                                 {AV_PIX_FMT_YUVJ440P, AV_PIX_FMT_YUV440P},
                                                 {AV_PIX_FMT_YUVJ411P, AV_PIX_FMT_YUV411P}};
  for (const auto& [of_jpeg, usual] : kOfJpeg)
    if (format == of_jpeg) {
      *full_range = true;
      return usual;
    }
  return static_cast<AVPixelFormat>(format);
}

// FFmpeg puts a file's numbers into its enumerations as they are: one beyond its list counts as not stated. Read as an
// integer first, because an enumeration that holds no value of its own may not be read.
template <typename Enum>
Enum Stated(const Enum& in_file, Enum beyond, Enum not_stated) {
  std::underlying_type_t<Enum> number;
  std::memcpy(&number, &in_file, sizeof number);
  return number < static_cast<std::underlying_type_t<Enum>>(beyond) ? static_cast<Enum>(number) : not_stated;
}

}  // namespace

const AVPixFmtDescriptor& Descriptor(AVPixelFormat format) { return *av_pix_fmt_desc_get(format); }
bool IsRgb(AVPixelFormat format) { return Descriptor(format).flags & (AV_PIX_FMT_FLAG_RGB | AV_PIX_FMT_FLAG_PAL); }
bool IsGrey(AVPixelFormat format) { return Descriptor(format).nb_components < 3; }

Colours ColoursOf(const AVFrame& frame) {
  Colours c;
  c.width = frame.width;
  c.height = frame.height;
  const AVColorRange range = Stated(frame.color_range, AVCOL_RANGE_NB, AVCOL_RANGE_UNSPECIFIED);
  c.full_range = range == AVCOL_RANGE_JPEG;
  c.format = UsualFormat(frame.format, &c.full_range);
  c.matrix = Stated(frame.colorspace, AVCOL_SPC_NB, AVCOL_SPC_UNSPECIFIED);
  c.transfer = Stated(frame.color_trc, AVCOL_TRC_NB, AVCOL_TRC_UNSPECIFIED);
  c.primaries = Stated(frame.color_primaries, AVCOL_PRI_NB, AVCOL_PRI_UNSPECIFIED);
  c.chroma = Stated(frame.chroma_location, AVCHROMA_LOC_NB, AVCHROMA_LOC_UNSPECIFIED);
  if (IsGrey(c.format) && range == AVCOL_RANGE_UNSPECIFIED) c.full_range = true;
  if (c.matrix == AVCOL_SPC_UNSPECIFIED || c.matrix == AVCOL_SPC_RESERVED ||
      (c.matrix == AVCOL_SPC_RGB && !IsRgb(c.format)))
    c.matrix = c.Hdr()                                         ? AVCOL_SPC_BT2020_NCL
               : c.height >= kHdLines || c.width >= kHdColumns ? AVCOL_SPC_BT709
                                                               : AVCOL_SPC_SMPTE170M;
  return c;
}

}  // namespace lumi::ffmpeg
