// RGB frames become an MP4.
#pragma once

#include "scene/files/video_codecs.h"

namespace lumi::ffmpeg {

std::unique_ptr<VideoEncoder> OpenEncoder(const std::filesystem::path& file, const std::filesystem::path& path,
                                          const VideoShape& shape, int threads);

}  // namespace lumi::ffmpeg
