// Frames of a video, and the times of its packets.
#pragma once

#include "scene/files/video_codecs.h"

namespace lumi::ffmpeg {

std::unique_ptr<VideoDecoder> OpenDecoder(const std::filesystem::path& path, int threads);
std::string ReadComment(const std::filesystem::path& path);
PacketTimes ReadPacketTimes(const std::filesystem::path& path);

}  // namespace lumi::ffmpeg
