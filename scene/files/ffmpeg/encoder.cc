#include "scene/files/ffmpeg/encoder.h"

#include <fmt/format.h>

#include <cmath>

extern "C" {
#include <libavutil/opt.h>
}

#include "scene/files/ffmpeg/owners.h"
#include "scene/program/error.h"

namespace lumi::ffmpeg {
namespace {

constexpr int kLargestDenominator = 1001000;  // of a rate: 30000/1001 is met exactly

// With AVX-512 libx264 (0.164, of Debian 12 and 13) plans its bits by memory that it has not written: the same frames
// become other films each time.
bool HasAvx512() {
#if defined(__x86_64__)
  return __builtin_cpu_supports("avx512f");
#else
  return false;
#endif
}

// H.264, BT.709 in limited range, with both stated in the file. Players assume these for HD; for smaller frames they
// need the statement.
class Encoder : public VideoEncoder {
 public:
  Encoder(const std::filesystem::path& file, std::filesystem::path path, const VideoShape& shape, int threads)
      : path_(std::move(path)), ticks_per_s_(shape.ticks_per_s) {
    KeepWords();
    ForgetWords();
    const std::string url = "file:" + file.string();
    AVFormatContext* output = nullptr;
    Check(avformat_alloc_output_context2(&output, nullptr, "mp4", url.c_str()));
    output_.reset(output);
    stream_ = avformat_new_stream(output, nullptr);
    OpenCodec(shape, threads);
    Check(avcodec_parameters_from_context(stream_->codecpar, codec_.get()));
    stream_->time_base = codec_->time_base;
    stream_->avg_frame_rate = codec_->framerate;
    Check(avio_open(&output->pb, url.c_str(), AVIO_FLAG_WRITE));
    av_dict_set(&output->metadata, "comment", kFilmComment, 0);
    AVDictionary* options = nullptr;
    av_dict_set(&options, "movflags", "+faststart", 0);
    if (ticks_per_s_ > 0) av_dict_set_int(&options, "video_track_timescale", ticks_per_s_, 0);
    const int error = avformat_write_header(output, &options);
    av_dict_free(&options);
    Check(error);
    OpenScaler(shape);
  }

  void Add(const Image8& rgb, std::int64_t tick) override {
    ForgetWords();
    // The encoder may keep the frame: its planes are made anew where it does.
    Check(av_frame_make_writable(planes_.get()));
    const std::uint8_t* rows[] = {rgb.data.data()};
    const int strides[] = {3 * rgb.width};
    if (sws_scale(scaler_.get(), rows, strides, 0, rgb.height, planes_->data, planes_->linesize) != rgb.height)
      Fail("a frame's colours cannot be converted");
    planes_->pts = tick;
    Check(avcodec_send_frame(codec_.get(), planes_.get()));
    TakePackets();
  }

  void Finish() override {
    ForgetWords();
    Check(avcodec_send_frame(codec_.get(), nullptr));
    TakePackets();
    Check(av_write_trailer(output_.get()));
    avio_flush(output_->pb);
    Check(output_->pb->error);
    Check(avio_closep(&output_->pb));
  }

 private:
  void OpenCodec(const VideoShape& shape, int threads) {
    const AVCodec* h264 = avcodec_find_encoder_by_name("libx264");
    if (!h264)
      throw MachineError("this FFmpeg cannot write H.264: it lacks libx264",
                         "install an FFmpeg that has it, as Debian's", path_);
    codec_.reset(avcodec_alloc_context3(h264));
    AVCodecContext& c = *codec_;
    c.width = shape.width;
    c.height = shape.height;
    c.pix_fmt = AV_PIX_FMT_YUV420P;
    c.framerate = av_d2q(shape.fps, kLargestDenominator);
    c.time_base = ticks_per_s_ > 0 ? AVRational{1, ticks_per_s_} : av_inv_q(c.framerate);
    c.colorspace = AVCOL_SPC_BT709;
    c.color_primaries = AVCOL_PRI_BT709;
    c.color_trc = AVCOL_TRC_BT709;
    c.color_range = AVCOL_RANGE_MPEG;
    c.chroma_sample_location = AVCHROMA_LOC_LEFT;
    c.thread_count = threads;
    c.flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
    frame_ticks_ = std::max<std::int64_t>(1, std::llround(1 / (shape.fps * av_q2d(c.time_base))));
    av_opt_set(c.priv_data, "preset", "medium", 0);
    av_opt_set(c.priv_data, "crf", "18", 0);
    if (HasAvx512()) av_opt_set(c.priv_data, "x264-params", "asm=avx2", 0);
    Check(avcodec_open2(&c, h264, nullptr));
    planes_.reset(av_frame_alloc());
    planes_->format = c.pix_fmt;
    planes_->width = c.width;
    planes_->height = c.height;
    planes_->colorspace = c.colorspace;
    planes_->color_primaries = c.color_primaries;
    planes_->color_trc = c.color_trc;
    planes_->color_range = c.color_range;
    planes_->chroma_location = c.chroma_sample_location;
    Check(av_frame_get_buffer(planes_.get(), 0));
  }

  void OpenScaler(const VideoShape& shape) {
    scaler_.reset(sws_alloc_context());
    SwsContext* s = scaler_.get();
    const auto set = [&](const char* name, std::int64_t value) { av_opt_set_int(s, name, value, 0); };
    set("srcw", shape.width), set("srch", shape.height), set("dstw", shape.width), set("dsth", shape.height);
    set("src_format", AV_PIX_FMT_RGB24), set("dst_format", AV_PIX_FMT_YUV420P);
    set("src_range", 1), set("dst_range", 0);
    set("dst_h_chr_pos", 0), set("dst_v_chr_pos", 128);
    set("sws_flags", SWS_BICUBIC | SWS_ACCURATE_RND | SWS_FULL_CHR_H_INT | SWS_FULL_CHR_H_INP);
    Check(sws_init_context(s, nullptr, nullptr));
    const int* bt709 = sws_getCoefficients(SWS_CS_ITU709);
    sws_setColorspaceDetails(s, bt709, 1, bt709, 0, 0, 1 << 16, 1 << 16);
  }

  void TakePackets() {
    for (;;) {
      const int got = avcodec_receive_packet(codec_.get(), packet_.get());
      if (got == AVERROR(EAGAIN) || got == AVERROR_EOF) return;
      Check(got);
      if (packet_->duration <= 0) packet_->duration = frame_ticks_;
      av_packet_rescale_ts(packet_.get(), codec_->time_base, stream_->time_base);
      packet_->stream_index = stream_->index;
      Check(av_interleaved_write_frame(output_.get(), packet_.get()));
      Check(output_->pb->error);
    }
  }

  void Check(int error) {
    if (error < 0) Fail(Words(error));
  }
  [[noreturn]] void Fail(const std::string& why) {
    throw MachineError(fmt::format("cannot write the video: {}", why), "is the disk full?", path_);
  }

  std::filesystem::path path_;
  int ticks_per_s_;
  std::int64_t frame_ticks_ = 1;  // the last frame's duration: no later time stamp tells it
  OutputPtr output_;
  AVStream* stream_ = nullptr;
  CodecPtr codec_;
  ScalerPtr scaler_;
  FramePtr planes_;
  PacketPtr packet_{av_packet_alloc()};
};

}  // namespace

std::unique_ptr<VideoEncoder> OpenEncoder(const std::filesystem::path& file, const std::filesystem::path& path,
                                          const VideoShape& shape, int threads) {
  return std::make_unique<Encoder>(file, path, shape, threads);
}

}  // namespace lumi::ffmpeg
