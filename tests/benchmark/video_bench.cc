// Frames a second, and milliseconds of processor time a frame: our reader beside the decoder alone and OpenCV's reader.
//
//   video_bench VIDEO [ROUNDS]
//
// The three take turns; printed is the least of all rounds. With fewer processors than the decoder has threads, the
// processor time is what counts.
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>
#include <string>

#include "scene/files/video.h"
#include "scene/program/error.h"

namespace {

double ProcessorSeconds() {
  rusage use{};
  getrusage(RUSAGE_SELF, &use);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(use.ru_utime) + seconds(use.ru_stime);
}

struct Cost {
  double wall_s = 1e30, processor_s = 1e30;
  int frames = 0;
};

void Measure(const std::function<int()>& read, Cost& least) {
  const auto start = std::chrono::steady_clock::now();
  const double processor = ProcessorSeconds();
  least.frames = read();
  least.wall_s =
      std::min(least.wall_s, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  least.processor_s = std::min(least.processor_s, ProcessorSeconds() - processor);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "video_bench VIDEO [ROUNDS]\n");
    return 2;
  }
  const std::string video = argv[1];
  const int rounds = argc > 2 ? std::max(1, std::atoi(argv[2])) : 3;
  Cost decoder, ours, opencv;
  try {
    for (int round = 0; round < rounds; ++round) {
      Measure(
          [&] {
            lumi::VideoReader reader(video);
            while (reader.Skip()) continue;
            return reader.frames_read();
          },
          decoder);
      Measure(
          [&] {
            lumi::VideoReader reader(video);
            while (reader.Next()) continue;
            return reader.frames_read();
          },
          ours);
      Measure(
          [&] {
            cv::VideoCapture capture(video, cv::CAP_FFMPEG);
            cv::Mat frame;
            int frames = 0;
            while (capture.read(frame)) ++frames;
            return frames;
          },
          opencv);
    }
  } catch (const lumi::Error& e) {
    std::fprintf(stderr, "video_bench: %s: %s\n", video.c_str(), e.what());
    return 3;
  }
  std::printf("| reader | frames | frames a second | processor ms a frame |\n|---|---|---|---|\n");
  for (const auto& [name, cost] :
       {std::pair{"decoder alone", &decoder}, {"ours", &ours}, {"OpenCV (other colours)", &opencv}})
    std::printf("| %s | %d | %.1f | %.2f |\n", name, cost->frames, cost->frames / cost->wall_s,
                1e3 * cost->processor_s / cost->frames);
  return 0;
}
