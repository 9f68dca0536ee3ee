// A chain of libavfilter's filters that frames are sent through.
#pragma once

#include <string>

#include "scene/files/ffmpeg/colours.h"

namespace lumi::ffmpeg {

class FilterGraph {
 public:
  // For frames of this size and these colours. `chain` as ffmpeg's -vf has it. Returns FFmpeg's error, negative, or 0.
  int Prepare(const Colours& frames, AVRational pixel_aspect, const std::string& chain, int threads);
  explicit operator bool() const { return graph_ != nullptr; }
  void Reset() { *this = {}; }
  // The frame stays the caller's; none: the end. Returns FFmpeg's error or 0.
  int Send(AVFrame* frame);
  // FFmpeg's error or 0: AVERROR(EAGAIN) where another frame has to be sent first, AVERROR_EOF after the last.
  int Receive(AVFrame& frame);

 private:
  GraphPtr graph_;
  AVFilterContext *source_ = nullptr, *sink_ = nullptr;  // graph_'s
};

}  // namespace lumi::ffmpeg
