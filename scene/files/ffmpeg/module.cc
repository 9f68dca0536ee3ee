// What liblumi_video.so offers.
#include "scene/files/ffmpeg/decoder.h"
#include "scene/files/ffmpeg/encoder.h"

namespace {

constexpr lumi::VideoCodecs kVideoCodecs{lumi::ffmpeg::OpenDecoder, lumi::ffmpeg::ReadPacketTimes,
                                         lumi::ffmpeg::ReadComment, lumi::ffmpeg::OpenEncoder};

}  // namespace

extern "C" __attribute__((visibility("default"))) const lumi::VideoCodecs* LumigraphVideoCodecs() {
  return &kVideoCodecs;
}
