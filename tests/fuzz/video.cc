// A video's first frames, and the times of all by their packets. FFmpeg and OpenCV are not instrumented: what is looked
// at here is what our door makes of it.
#include <cmath>

#include "scene/files/video.h"
#include "tests/fuzz/fuzz_target.h"

namespace lumi::fuzz {

LUMI_FUZZ_TARGET(video) {
  const std::filesystem::path file = InputFile("video.mp4", bytes);
  VideoReader video(file);
  Require(video.fps() > 0 && std::isfinite(video.fps()), "frames a second");
  double last_s = -1;
  for (int i = 0; i < 8; ++i) {
    const auto frame = video.Next();
    if (!frame) break;
    Require(frame->time_s > last_s, "time does not go on");
    Require(frame->rgb.width > 0 && frame->rgb.height > 0, "a frame of nothing");
    last_s = frame->time_s;
  }
  const VideoTimes times = ReadVideoTimes(file);
  Require(times.fps > 0 && std::isfinite(times.fps) && times.average_fps > 0 && std::isfinite(times.average_fps),
          "frames a second, by the packets");
  for (std::size_t i = 0; i < times.time_s.size(); ++i)
    Require(std::isfinite(times.time_s[i]) && (i == 0 || times.time_s[i] > times.time_s[i - 1]),
            "time does not go on, by the packets");
}

}  // namespace lumi::fuzz
