#include "timeperiodic/frame_stack.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scene/files/image_io.h"
#include "scene/files/video_clock.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"

namespace lumi {
namespace {

constexpr std::size_t kStackBatch = 64;  // frames scaled at once, at most
constexpr double kWholeFrames = 1e-6;    // times nearer to whole frames are whole

void FindRepeated(FrameStack& stack, const std::vector<std::uint64_t>& sums) {
  for (std::size_t i = 1; i < sums.size(); ++i)
    if (sums[i] == sums[i - 1]) stack.repeated.push_back(static_cast<int>(i));
}

std::uint64_t HashOf(const Image8& image) {  // FNV-1a over bytes, enough to tell neighbouring frames apart
  std::uint64_t hash = 0xcbf29ce484222325ULL;
  for (const std::uint8_t v : image.data) hash = (hash ^ v) * 0x100000001b3ULL;
  return hash;
}

}  // namespace

FrameStack ReadFrameStack(const std::filesystem::path& path, const FrameStackOptions& options, ProgressSink& sink) {
  VideoReader video(path);
  const VideoTimes times = ReadUsableTimes(path);
  const auto too_long = [&] {
    return DataError(fmt::format("the video has more than {} frames", options.max_frames),
                     "cut a part out of it that shows some 20 periods", path);
  };
  if (options.first_frames == 0 && times.time_s.size() > static_cast<std::size_t>(options.max_frames)) throw too_long();
  const VideoClock clock(times);
  FrameStack stack;
  stack.fps = clock.fps();
  stack.video_width = video.width();
  stack.video_height = video.height();
  std::vector<std::uint64_t> hashes;
  std::vector<Image8> batch;
  const std::size_t at_once = FramesAtOnce(video.width(), video.height(), kStackBatch);
  Progress progress(sink, "reading " + path.filename().string(), video.frame_count_hint());
  const auto flush = [&] {
    const std::size_t first = stack.frames.size();
    stack.frames.resize(first + batch.size());
    hashes.resize(first + batch.size());
    ParallelEach(batch.size(), 1, [&](std::size_t i) {
      hashes[first + i] = HashOf(batch[i]);
      stack.frames[first + i] =
          stack.width == batch[i].width ? std::move(batch[i]) : Resize(batch[i], stack.width, stack.height);
    });
    batch.clear();
  };
  while (auto frame = video.Next()) {
    if (stack.width == 0) {
      stack.video_width = frame->rgb.width;
      stack.video_height = frame->rgb.height;
      const double frames = std::max(1.0, static_cast<double>(times.time_s.size()));
      const double aspect = static_cast<double>(stack.video_height) / stack.video_width;
      const double widest = std::sqrt(options.max_bytes / (3 * frames * aspect));
      stack.width = std::max(16, std::min({options.max_width_px, stack.video_width, static_cast<int>(widest)}));
      stack.height = std::max(1, static_cast<int>(std::lround(stack.width * aspect)));
    }
    if (frame->rgb.width != stack.video_width || frame->rgb.height != stack.video_height)
      throw InputError(path, fmt::format("frame {} has another size than the first", frame->index));
    if (options.first_frames > 0 && static_cast<int>(stack.time_s.size()) >= options.first_frames) break;
    if (static_cast<int>(stack.time_s.size()) >= options.max_frames) throw too_long();
    stack.time_s.push_back(frame->time_s);
    batch.push_back(std::move(frame->rgb));
    if (batch.size() >= at_once) flush();
    progress.Step();
  }
  flush();
  if (stack.frames.empty()) throw InputError(path, "has no frame that can be decoded");
  stack.truncated = video.truncated();
  for (const std::string& remark : video.remarks()) sink.Message(remark);
  for (std::size_t i = 0; i < stack.frames.size(); ++i) {
    const double time = clock.TimeOf(stack.time_s[i] - stack.time_s[0]) * stack.fps;
    stack.time.push_back(std::abs(time - std::round(time)) < kWholeFrames ? std::round(time) : time);
    stack.uneven = stack.uneven || stack.time.back() != static_cast<double>(i);
  }
  FindRepeated(stack, hashes);
  return stack;
}

FrameStack StackOf(std::vector<Image8> frames, double fps, std::vector<double> time) {
  FrameStack stack;
  stack.fps = fps;
  if (!frames.empty())
    stack.video_width = stack.width = frames[0].width, stack.video_height = stack.height = frames[0].height;
  std::vector<std::uint64_t> hashes;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    hashes.push_back(HashOf(frames[i]));
    stack.time.push_back(time.empty() ? static_cast<double>(i) : time.at(i));
    stack.time_s.push_back(stack.time.back() / fps);
    stack.uneven = stack.uneven || stack.time.back() != static_cast<double>(i);
  }
  FindRepeated(stack, hashes);
  stack.frames = std::move(frames);
  return stack;
}

}  // namespace lumi
