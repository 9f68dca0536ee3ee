#include "scene/files/ffmpeg/to_rgb.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <optional>
#include <utility>

extern "C" {
#include <libavutil/mastering_display_metadata.h>
#include <libavutil/opt.h>
}

#include "scene/program/error.h"

namespace lumi::ffmpeg {
namespace {

constexpr int kScaling = SWS_BICUBIC | SWS_ACCURATE_RND | SWS_FULL_CHR_H_INT | SWS_FULL_CHR_H_INP;
// HDR (ITU-R BT.2408), in cd/m2: paper white, and the peak brightness that is assumed where a film states none.
constexpr double kReferenceWhite = 203, kUsualPeak = 1000, kLargestPeak = 10000;

// libswscale's table of coefficients; nothing where it has none.
std::optional<int> ScalerMatrix(AVColorSpace matrix) {
  switch (matrix) {
    case AVCOL_SPC_BT709: return SWS_CS_ITU709;
    case AVCOL_SPC_FCC: return SWS_CS_FCC;
    case AVCOL_SPC_BT470BG:
    case AVCOL_SPC_SMPTE170M: return SWS_CS_ITU601;
    case AVCOL_SPC_SMPTE240M: return SWS_CS_SMPTE240M;
    case AVCOL_SPC_BT2020_NCL: return SWS_CS_BT2020;
    case AVCOL_SPC_RGB: return SWS_CS_DEFAULT;  // unused: such frames hold RGB
    default: return std::nullopt;
  }
}

// cd/m2 of the brightest pixel, as the film says.
double PeakOf(const AVFrame& frame) {
  double peak = 0;
  if (const AVFrameSideData* d = av_frame_get_side_data(&frame, AV_FRAME_DATA_CONTENT_LIGHT_LEVEL))
    peak = reinterpret_cast<const AVContentLightMetadata*>(d->data)->MaxCLL;
  if (const AVFrameSideData* d = av_frame_get_side_data(&frame, AV_FRAME_DATA_MASTERING_DISPLAY_METADATA);
      d && !(peak > 0))
    if (const auto* m = reinterpret_cast<const AVMasteringDisplayMetadata*>(d->data); m->has_luminance)
      peak = av_q2d(m->max_luminance);
  return peak > kReferenceWhite && peak <= kLargestPeak ? peak : kUsualPeak;
}

void SetOption(void* object, const char* name, std::int64_t value) { av_opt_set_int(object, name, value, 0); }

}  // namespace

// The size at which pixels are square; none of the frame's pixels are lost.
static std::pair<int, int> SquareSize(const AVFrame& frame, double pixel_aspect) {
  constexpr double kMostAspect = 4;  // beyond: a broken file
  const double aspect = pixel_aspect > 1 / kMostAspect && pixel_aspect < kMostAspect ? pixel_aspect : 1;
  return {static_cast<int>(std::lround(frame.width * std::max(1.0, aspect))),
          static_cast<int>(std::lround(frame.height / std::min(1.0, aspect)))};
}

ToRgb::ToRgb(std::filesystem::path path, const AVFrame& first, double pixel_aspect, const Turn& turn, int threads)
    : path_(std::move(path)),
      turn_(turn),
      width_(SquareSize(first, pixel_aspect).first),
      height_(SquareSize(first, pixel_aspect).second),
      stretched_(width_ != first.width || height_ != first.height),
      threads_(threads),
      peak_(PeakOf(first)) {
  if (!av_pix_fmt_desc_get(static_cast<AVPixelFormat>(first.format)))
    throw InputError(path_, "has frames of a kind that cannot be read");
  Prepare(ColoursOf(first));
}

ToRgb::~ToRgb() = default;

void ToRgb::Prepare(const Colours& colours) {
  colours_ = colours;
  scaler_.reset();
  tone_map_.Reset();
  av_frame_unref(planes_.get());
  const bool rgb = IsRgb(colours.format) || IsGrey(colours.format);
  if (colours.Hdr() && !rgb)
    PrepareToneMap();
  else if (!rgb && !ScalerMatrix(colours.matrix)) {
    const char* name = av_color_space_name(colours.matrix);
    throw InputError(path_, fmt::format("names a colour matrix that cannot be decoded: {}", name ? name : "unknown"),
                     "re-encode it: ffmpeg -i IN -vf zscale=m=709 OUT.mp4");
  } else
    PrepareScaler();
}

// To three planes: libswscale is several times as fast with them as with RGB side by side, and as accurate.
void ToRgb::PrepareScaler() {
  if (!sws_isSupportedInput(colours_.format))
    throw InputError(path_,
                     fmt::format("has pixels of a kind that cannot be converted: {}", Descriptor(colours_.format).name),
                     "re-encode it: ffmpeg -i IN -pix_fmt yuv420p OUT.mp4");
  scaler_.reset(sws_alloc_context());
  SwsContext* s = scaler_.get();
  SetOption(s, "srcw", colours_.width), SetOption(s, "srch", colours_.height);
  SetOption(s, "dstw", width_), SetOption(s, "dsth", height_);
  SetOption(s, "src_format", colours_.format), SetOption(s, "dst_format", AV_PIX_FMT_GBRP);
  SetOption(s, "src_range", colours_.full_range), SetOption(s, "dst_range", 1);
  SetOption(s, "sws_flags", kScaling), SetOption(s, "threads", threads_);
  // Where a chroma sample is, in 256ths of a pixel: beside the left pixel and between the rows, where nothing is said.
  if (const auto& d = Descriptor(colours_.format); d.log2_chroma_w || d.log2_chroma_h) {
    const AVChromaLocation at = colours_.chroma;
    const bool centred = at == AVCHROMA_LOC_CENTER || at == AVCHROMA_LOC_TOP || at == AVCHROMA_LOC_BOTTOM;
    const int y = at == AVCHROMA_LOC_TOPLEFT || at == AVCHROMA_LOC_TOP         ? 0
                  : at == AVCHROMA_LOC_BOTTOMLEFT || at == AVCHROMA_LOC_BOTTOM ? 256
                                                                               : 128;
    if (d.log2_chroma_w == 1) SetOption(s, "src_h_chr_pos", centred ? 128 : 0);
    if (d.log2_chroma_h == 1) SetOption(s, "src_v_chr_pos", y);
  }
  const int error = sws_init_context(s, nullptr, nullptr);
  if (error < 0) throw InputError(path_, fmt::format("its colours cannot be converted: {}", Words(error)));
  const int* from = sws_getCoefficients(ScalerMatrix(colours_.matrix).value_or(SWS_CS_DEFAULT));
  const bool full = colours_.full_range || IsRgb(colours_.format);
  sws_setColorspaceDetails(s, from, full, sws_getCoefficients(SWS_CS_ITU709), 1, 0, 1 << 16, 1 << 16);
}

// PQ and HLG: to light with paper white at 1, to BT.709's primaries, what is brighter rolled off (Mobius; what is
// dark stays linear), and to sRGB's code values. The curve is the same for all frames, as matching photos needs it.
void ToRgb::PrepareToneMap() {
  if (!avfilter_get_by_name("zscale") || !avfilter_get_by_name("tonemap"))
    throw MachineError("is an HDR video, and this FFmpeg cannot make SDR of it: it lacks the filter zscale",
                       "install an FFmpeg that has it, as Debian's, or convert the video first", path_);
  const std::string chain = fmt::format(
      "zscale=w={}:h={}:t=linear:npl={},format=gbrpf32le,zscale=p=bt709,tonemap=tonemap=mobius:desat=0:peak={},"
      "zscale=t=iec61966-2-1,format=gbrp",
      width_, height_, kReferenceWhite, peak_ / kReferenceWhite);
  if (const int error = tone_map_.Prepare(colours_, {1, 1}, chain, threads_); error < 0)
    throw InputError(path_, fmt::format("its HDR colours cannot be converted: {}", Words(error)),
                     "convert it to SDR first");
}

std::vector<std::string> ToRgb::Remarks() const {
  std::vector<std::string> remarks;
  const std::string file = path_.filename().string();
  if (turn_.skew)
    remarks.push_back(fmt::format("{} asks to be turned by other than quarter turns: the nearest one is taken", file));
  if (stretched_)
    remarks.push_back(
        fmt::format("{} has pixels that are not square: its frames are made {} x {}", file, width(), height()));
  if (tone_map_)
    remarks.push_back(fmt::format("{} is HDR ({}, peak {:.0f} cd/m2): tone-mapped to SDR with paper white at {} cd/m2",
                                  file, colours_.transfer == AVCOL_TRC_SMPTE2084 ? "PQ" : "HLG", peak_,
                                  kReferenceWhite));
  else if (colours_.primaries == AVCOL_PRI_BT2020 || colours_.primaries == AVCOL_PRI_SMPTE432)
    remarks.push_back(fmt::format("{} has {} primaries without HDR: shown as BT.709's, a little duller than filmed",
                                  file, colours_.primaries == AVCOL_PRI_BT2020 ? "BT.2020" : "Display P3"));
  else if (const int depth = Descriptor(colours_.format).comp[0].depth; depth > 8)
    remarks.push_back(fmt::format("{} has {} bits a channel: rounded to 8", file, depth));
  return remarks;
}

Image8 ToRgb::Convert(AVFrame& frame) {
  ForgetWords();
  if (!av_pix_fmt_desc_get(static_cast<AVPixelFormat>(frame.format)))
    throw InputError(path_, "has frames of a kind that cannot be read");
  if (const Colours colours = ColoursOf(frame); colours != colours_) Prepare(colours);
  frame.format = colours_.format;
  frame.colorspace = colours_.matrix;
  frame.color_range = colours_.full_range ? AVCOL_RANGE_JPEG : AVCOL_RANGE_MPEG;
  int error = 0;
  if (tone_map_) {
    if (colours_.primaries == AVCOL_PRI_UNSPECIFIED) frame.color_primaries = AVCOL_PRI_BT2020;
    frame.pts = 0;
    error = tone_map_.Send(&frame);
    if (error >= 0) error = tone_map_.Receive(*planes_);
  } else {
    error = sws_scale_frame(scaler_.get(), planes_.get(), &frame);
  }
  if (error < 0 || planes_->width != width_ || planes_->height != height_)
    throw InputError(path_, fmt::format("a frame's colours cannot be converted: {}", Words(error)));
  const auto plane = [&](int i) {
    return cv::Mat(height_, width_, CV_8U, planes_->data[i], static_cast<std::size_t>(planes_->linesize[i]));
  };
  const cv::Mat red_green_blue[3] = {plane(2), plane(0), plane(1)};
  Image8 picture(width(), height(), 3);
  cv::Mat shown(height(), width(), CV_8UC3, picture.data.data());
  if (turn_.transpose) {
    cv::Mat merged;
    cv::merge(red_green_blue, 3, merged);
    cv::transpose(merged, shown);
  } else {
    cv::merge(red_green_blue, 3, shown);
  }
  if (turn_.flip_x || turn_.flip_y) cv::flip(shown, shown, turn_.flip_x && turn_.flip_y ? -1 : turn_.flip_x ? 1 : 0);
  return picture;
}

}  // namespace lumi::ffmpeg
