// FFmpeg's objects with owners, and its words. Inside the module liblumi_video.so only.
#pragma once

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavfilter/avfilter.h>
#include <libavformat/avformat.h>
#include <libavutil/frame.h>
#include <libswscale/swscale.h>
}

#include <memory>
#include <string>

namespace lumi::ffmpeg {

template <auto Free>
struct FreeByAddress {
  template <typename T>
  void operator()(T* p) const {
    Free(&p);
  }
};
struct FreeScaler {
  void operator()(SwsContext* p) const { sws_freeContext(p); }
};
struct FreeParser {
  void operator()(AVCodecParserContext* p) const { av_parser_close(p); }
};
struct CloseOutput {
  void operator()(AVFormatContext* p) const {
    if (p->pb) avio_closep(&p->pb);
    avformat_free_context(p);
  }
};
using FramePtr = std::unique_ptr<AVFrame, FreeByAddress<av_frame_free>>;
using PacketPtr = std::unique_ptr<AVPacket, FreeByAddress<av_packet_free>>;
using CodecPtr = std::unique_ptr<AVCodecContext, FreeByAddress<avcodec_free_context>>;
using GraphPtr = std::unique_ptr<AVFilterGraph, FreeByAddress<avfilter_graph_free>>;
using ScalerPtr = std::unique_ptr<SwsContext, FreeScaler>;
using OutputPtr = std::unique_ptr<AVFormatContext, CloseOutput>;

// FFmpeg prints nothing from now on; its last error of each thread is kept.
void KeepWords();
void ForgetWords();
// One line: what FFmpeg said last in this thread since ForgetWords, else what the error code means.
std::string Words(int error);

}  // namespace lumi::ffmpeg
