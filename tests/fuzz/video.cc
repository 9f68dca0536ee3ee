// A video's first frames. FFmpeg and OpenCV are not instrumented: what is looked at here is what our door makes of it.
#include <cmath>

#include "scene/files/video.h"
#include "tests/fuzz/fuzz_target.h"

namespace lumi::fuzz {

LUMI_FUZZ_TARGET(video) {
  VideoReader video(InputFile("video.mp4", bytes));
  Require(video.fps() > 0 && std::isfinite(video.fps()), "frames a second");
  double last_s = -1;
  for (int i = 0; i < 8; ++i) {
    const auto frame = video.Next();
    if (!frame) break;
    Require(frame->time_s > last_s, "time does not go on");
    Require(frame->rgb.width > 0 && frame->rgb.height > 0, "a frame of nothing");
    last_s = frame->time_s;
  }
}

}  // namespace lumi::fuzz
