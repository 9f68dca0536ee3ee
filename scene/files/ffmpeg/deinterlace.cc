#include "scene/files/ffmpeg/deinterlace.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <utility>

extern "C" {
#include <libavutil/dict.h>
}

#include "scene/program/error.h"

namespace lumi::ffmpeg {
namespace {

constexpr const char* kFilter = "bwdif";

// Frames enter a graph with the words that it was prepared with: a frame's own may be missing.
void GiveColours(AVFrame& frame, const Colours& colours) {
  frame.format = colours.format;
  frame.colorspace = colours.matrix;
  frame.color_range = colours.full_range ? AVCOL_RANGE_JPEG : AVCOL_RANGE_MPEG;
}

bool Convertible(const AVFrame& frame) { return av_pix_fmt_desc_get(static_cast<AVPixelFormat>(frame.format)); }

double Number(const AVFrame& frame, const char* key) {
  const AVDictionaryEntry* entry = av_dict_get(frame.metadata, key, nullptr, 0);
  return entry ? std::strtod(entry->value, nullptr) : 0;
}

}  // namespace

bool MarkedInterlaced(const AVFrame& frame) {
#if LIBAVUTIL_VERSION_MAJOR >= 59
  return frame.flags & AV_FRAME_FLAG_INTERLACED;
#else
  return frame.interlaced_frame;
#endif
}

std::optional<bool> OfOneMoment(const std::deque<const AVFrame*>& frames, int threads) {
  if (frames.empty() || !Convertible(*frames[0]) || !avfilter_get_by_name("idet")) return std::nullopt;
  const Colours colours = ColoursOf(*frames[0]);
  FilterGraph graph;
  if (graph.Prepare(colours, frames[0]->sample_aspect_ratio, "idet", threads) < 0) return std::nullopt;
  double fields = 0, whole = 0;  // frames so far, as the filter counts them
  const FramePtr judged(av_frame_alloc());
  const auto take_counts = [&] {
    while (graph.Receive(*judged) >= 0) {
      fields = Number(*judged, "lavfi.idet.multiple.tff") + Number(*judged, "lavfi.idet.multiple.bff");
      whole = Number(*judged, "lavfi.idet.multiple.progressive");
    }
  };
  std::int64_t index = 0;
  for (const AVFrame* frame : frames) {
    // Rows of another length would be read as if they had the first frame's.
    if (!Convertible(*frame) || ColoursOf(*frame) != colours ||
        !std::ranges::equal(frame->linesize, frames[0]->linesize))
      break;
    const FramePtr sent(av_frame_clone(frame));
    if (!sent) return std::nullopt;
    GiveColours(*sent, colours);
    sent->pts = index++;
    if (graph.Send(sent.get()) < 0) return std::nullopt;
    take_counts();
  }
  if (graph.Send(nullptr) >= 0) take_counts();
  if (whole + fields == 0) return std::nullopt;
  return whole > fields;
}

bool Deinterlacer::Prepare(const AVFrame& like, int threads) {
  if (!Convertible(like) || !avfilter_get_by_name(kFilter)) return false;
  colours_ = ColoursOf(like);
  const std::string chain = fmt::format("{}=mode=send_frame:deint=interlaced", kFilter);
  return graph_.Prepare(colours_, like.sample_aspect_ratio, chain, threads) >= 0;
}

bool Deinterlacer::Takes(const AVFrame& frame) const { return Convertible(frame) && ColoursOf(frame) == colours_; }

void Deinterlacer::Check(int error) const {
  if (error < 0)
    throw InputError(path_, fmt::format("a frame cannot be deinterlaced: {}", Words(error)),
                     "deinterlace it first: ffmpeg -i IN -vf bwdif=send_frame OUT.mp4");
}

void Deinterlacer::Send(AVFrame& frame, std::int64_t stamp) {
  ForgetWords();
  GiveColours(frame, colours_);
  frame.pts = sent_++;
  Check(graph_.Send(&frame));
  stamps_.push_back(stamp);
}

void Deinterlacer::End() {
  ended_ = true;
  Check(graph_.Send(nullptr));
}

bool Deinterlacer::Receive(AVFrame& frame, std::int64_t& stamp) {
  if (stamps_.empty()) return false;
  const int error = graph_.Receive(frame);
  if (error == AVERROR(EAGAIN) && !ended_) return false;
  Check(error);
  stamp = stamps_.front();
  stamps_.pop_front();
  return true;
}

}  // namespace lumi::ffmpeg
