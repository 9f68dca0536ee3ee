#include "scene/files/ffmpeg/filter_graph.h"

extern "C" {
#include <libavfilter/buffersink.h>
#include <libavfilter/buffersrc.h>
#include <libavutil/mem.h>
}

namespace lumi::ffmpeg {

int FilterGraph::Prepare(const Colours& frames, AVRational pixel_aspect, const std::string& chain, int threads) {
  graph_.reset(avfilter_graph_alloc());
  if (!graph_) return AVERROR(ENOMEM);
  graph_->nb_threads = threads;
  source_ = avfilter_graph_alloc_filter(graph_.get(), avfilter_get_by_name("buffer"), "in");
  if (!source_) return AVERROR(ENOMEM);
  AVBufferSrcParameters* p = av_buffersrc_parameters_alloc();
  if (!p) return AVERROR(ENOMEM);
  p->format = frames.format;
  p->width = frames.width;
  p->height = frames.height;
  p->sample_aspect_ratio = pixel_aspect;
  p->time_base = {1, 1000};
#if LIBAVFILTER_VERSION_MAJOR >= 10
  p->color_space = frames.matrix;
  p->color_range = frames.full_range ? AVCOL_RANGE_JPEG : AVCOL_RANGE_MPEG;
#endif
  int error = av_buffersrc_parameters_set(source_, p);
  av_free(p);
  if (error >= 0) error = avfilter_init_str(source_, nullptr);
  if (error >= 0)
    error =
        avfilter_graph_create_filter(&sink_, avfilter_get_by_name("buffersink"), "out", nullptr, nullptr, graph_.get());
  if (error < 0) return error;
  AVFilterInOut *in = avfilter_inout_alloc(), *out = avfilter_inout_alloc();
  if (in && out) {
    *out = {av_strdup("in"), source_, 0, nullptr};
    *in = {av_strdup("out"), sink_, 0, nullptr};
    error = avfilter_graph_parse_ptr(graph_.get(), chain.c_str(), &in, &out, nullptr);
  } else {
    error = AVERROR(ENOMEM);
  }
  avfilter_inout_free(&in);
  avfilter_inout_free(&out);
  return error < 0 ? error : avfilter_graph_config(graph_.get(), nullptr);
}

int FilterGraph::Send(AVFrame* frame) {
  return av_buffersrc_add_frame_flags(source_, frame, AV_BUFFERSRC_FLAG_KEEP_REF);
}

int FilterGraph::Receive(AVFrame& frame) {
  av_frame_unref(&frame);
  return av_buffersink_get_frame(sink_, &frame);
}

}  // namespace lumi::ffmpeg
