#include "scene/files/video.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "scene/files/atomic_file.h"
#include "scene/files/file_name.h"
#include "scene/files/provenance.h"
#include "scene/files/video_codecs.h"
#include "scene/geometry/median.h"
#include "scene/program/error.h"
#include "scene/program/interrupt.h"
#include "scene/program/out_of_memory.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

constexpr double kAssumedFps = 30;       // where a container states none
constexpr double kMaxFps = 1000;         // beyond: a container's time base, not a rate
constexpr double kHintTolerance = 0.01;  // of a count that a container computes from its duration
constexpr double kConstant = 0.1;        // of a step: what frames of a constant rate are at most away from i / fps
constexpr int kTicksPerSecond = 90000;   // of a written video whose frames have their own times

void CheckIsFile(const fs::path& path) {
  std::error_code error;
  if (!fs::exists(path, error)) throw InputError(path, "there is no such video");
  if (!fs::is_regular_file(path, error)) throw InputError(path, "is no video file");
}

double RateOr(double fps, double otherwise) { return fps > 0 && fps <= kMaxFps ? fps : otherwise; }

}  // namespace

std::size_t FramesAtOnce(int width, int height, std::size_t most) {
  constexpr std::size_t kBytes = std::size_t{256} << 20;
  const std::size_t bytes =
      3 * static_cast<std::size_t>(std::max(1, width)) * static_cast<std::size_t>(std::max(1, height));
  return std::clamp(kBytes / bytes, std::min(most, static_cast<std::size_t>(ThreadCount())), most);
}

namespace {

// Times from the first frame, strictly increasing, from those that a file states.
class FrameClock {
 public:
  explicit FrameClock(double fps) : step_s_(1 / fps) {}

  double Next(double stated_s) {
    if (std::isnan(last_s_)) {
      made_up_ += std::isnan(stated_s);
      return Go(stated_s, 0);
    }
    if (std::isnan(start_s_) && !std::isnan(stated_s)) start_s_ = stated_s - (last_s_ + step_s_);
    const double time_s = stated_s - start_s_;
    if (time_s > last_s_) {
      falling_ = false;
      return Go(stated_s, time_s);
    }
    ++made_up_;
    // Two frames in a row with times from the past, the second after the first: the clock was set back, and is
    // followed. A single frame with a wrong time is not followed.
    const double own_step_s = stated_s - stated_s_;
    const double next_s = last_s_ + (falling_ && own_step_s > 0 ? own_step_s : step_s_);
    if (falling_ && own_step_s > 0) start_s_ = stated_s - next_s;
    falling_ = !std::isnan(stated_s);
    return Go(stated_s, next_s);
  }
  double last_s() const { return std::isnan(last_s_) ? 0 : last_s_; }
  int made_up() const { return made_up_; }

 private:
  double Go(double stated_s, double time_s) {
    if (std::isnan(last_s_)) start_s_ = stated_s;
    stated_s_ = stated_s;
    return last_s_ = time_s;
  }
  double step_s_;
  double start_s_ = NAN, last_s_ = NAN;  // the stated time that counts as 0; the time returned last
  double stated_s_ = NAN;                // stated time of the frame before
  bool falling_ = false;                 // the frame before stated a time that was past
  int made_up_ = 0;
};

bool IsConstant(const std::vector<double>& time_s, double fps, double tick_s) {
  const double tolerance_s = std::max(kConstant / fps, 1.01 * tick_s);
  for (std::size_t i = 0; i < time_s.size(); ++i)
    if (std::abs(time_s[i] - static_cast<double>(i) / fps) > tolerance_s) return false;
  return true;
}

}  // namespace

bool HasVideoExtension(const fs::path& path) {
  static constexpr std::array kExtensions{".mp4", ".m4v",  ".mov", ".avi", ".mkv", ".webm", ".mpg", ".mpeg",
                                          ".mts", ".m2ts", ".ts",  ".wmv", ".3gp", ".ogv",  ".flv"};
  const std::string e = LowerExtension(path);
  return std::find(kExtensions.begin(), kExtensions.end(), e) != kExtensions.end();
}

VideoTimes ReadVideoTimes(const fs::path& path) {
  CheckIsFile(path);
  const PacketTimes packets = LoadVideoCodecs().packet_times(path);
  const VideoClaims& claims = packets.claims;
  VideoTimes times;
  times.has_sound = claims.has_sound;
  times.fps = times.average_fps = RateOr(claims.average_fps, kAssumedFps);
  FrameClock clock(times.fps);
  std::vector<double> steps;
  for (const double stated_s : packets.stated_s) {
    times.time_s.push_back(clock.Next(stated_s));
    if (const std::size_t n = times.time_s.size(); n > 1) steps.push_back(times.time_s[n - 1] - times.time_s[n - 2]);
  }
  times.times_made_up = clock.made_up();
  if (steps.empty()) return times;
  times.largest_gap_s = *std::max_element(steps.begin(), steps.end());
  times.average_fps = static_cast<double>(steps.size()) / times.time_s.back();
  // A rate that the file states is exact where the times, which the container rounds, agree with it.
  const std::array rates{claims.average_fps, claims.nominal_fps, times.average_fps};
  for (const double rate : rates)
    if (rate > 0 && IsConstant(times.time_s, rate, claims.tick_s)) {
      times.fps = rate;
      return times;
    }
  times.constant = false;
  const double step_s = Median(steps);
  times.fps = 1 / step_s;
  for (const double rate : rates)
    if (rate > 0 && std::abs(1 / rate - step_s) <= 1.01 * claims.tick_s) {
      times.fps = rate;
      break;
    }
  return times;
}

struct VideoReader::Impl {
  fs::path path;
  std::unique_ptr<VideoDecoder> decoder;
  double fps = kAssumedFps;
  FrameClock clock{kAssumedFps};
  int read = 0;
  bool ended = false;

  bool Grab() {
    if (ended || !decoder->Grab()) {
      ended = true;
      return false;
    }
    clock.Next(decoder->StatedTime_s());
    ++read;
    return true;
  }
};

VideoReader::VideoReader(const fs::path& path) : impl_(std::make_unique<Impl>()) {
  CheckIsFile(path);
  Impl& v = *impl_;
  v.path = path;
  v.decoder = LoadVideoCodecs().open(path, ThreadCount());
  v.fps = RateOr(v.decoder->claims().average_fps, kAssumedFps);
  v.clock = FrameClock(v.fps);
}

VideoReader::~VideoReader() = default;

double VideoReader::fps() const { return impl_->fps; }
long VideoReader::frame_count_hint() const { return impl_->decoder->claims().frames; }
int VideoReader::width() const { return impl_->decoder->claims().width; }
int VideoReader::height() const { return impl_->decoder->claims().height; }
int VideoReader::frames_read() const { return impl_->read; }
double VideoReader::time_s() const { return impl_->clock.last_s(); }
int VideoReader::times_made_up() const { return impl_->clock.made_up(); }

std::vector<std::string> VideoReader::remarks() const {
  std::vector<std::string> remarks = impl_->decoder->claims().remarks;
  if (const int n = times_made_up(); n > 0)
    remarks.push_back(
        fmt::format("{}: {} of {} frames have no time, or one that is past: they follow at {:.5g} a second",
                    impl_->path.filename().string(), n, impl_->read, impl_->fps));
  return remarks;
}

bool VideoReader::Skip() { return impl_->Grab(); }

std::optional<VideoFrame> VideoReader::Next() {
  Impl& v = *impl_;
  if (!v.Grab()) return std::nullopt;
  return VideoFrame{v.read - 1, v.clock.last_s(), v.decoder->Picture()};
}

bool VideoReader::truncated() const {
  const Impl& v = *impl_;
  const VideoClaims& claims = v.decoder->claims();
  if (!v.ended) return false;
  if (claims.duration_s > 0) {
    const double slack_s = std::max(2 / v.fps, kHintTolerance * claims.duration_s);
    return v.clock.last_s() + 1 / v.fps + slack_s < claims.duration_s;
  }
  const auto frames = static_cast<double>(claims.frames);
  return claims.counted && v.read + std::max(2.0, kHintTolerance * frames) < frames;
}

void RequireOurFilm(const fs::path& file) {
  std::error_code error;
  if (fs::is_directory(file, error)) throw UsageError(file.string() + " is a folder", "name a file");
  RequireWritable(file);
  if (!fs::exists(file, error) || fs::file_size(file, error) == 0) return;
  if (IsAsRecorded(file)) return;  // a scene's film of an earlier version has no comment
  try {
    if (LoadVideoCodecs().comment(file) == kFilmComment) return;
  } catch (const InputError&) {  // no video
  }
  throw UsageError(file.string() + " is there, and is no film of ours: nothing was touched",
                   "choose another name, or remove it where an earlier version made it");
}

struct VideoWriter::Impl {
  fs::path path, temporary;
  std::unique_ptr<VideoEncoder> encoder;
  double fps = 0;
  int width = 0, height = 0;      // of the frames, before padding
  std::optional<double> start_s;  // where frames have their own times
  std::int64_t tick = -1;         // of the frame added last
  bool finished = false;

  void Add(const Image8& rgb, std::int64_t at);
  void Abandon() {
    encoder.reset();
    std::error_code ignored;
    fs::remove(temporary, ignored);
  }
};

VideoWriter::VideoWriter(const fs::path& path, double fps) : impl_(std::make_unique<Impl>()) {
  Impl& v = *impl_;
  if (!(fps > 0) || !(fps <= kMaxFps))
    throw UsageError(fmt::format("a video of {} frames a second cannot be written", fps));
  v.path = path;
  v.fps = fps;
  std::error_code error;
  if (path.has_parent_path()) fs::create_directories(path.parent_path(), error);
  if (error) throw MachineError(fmt::format("cannot be written: {}", error.message()), "choose another output", path);
  v.temporary = fs::absolute(TemporaryBeside(fs::path(path).replace_extension(".mp4"), "v"));
}

VideoWriter::~VideoWriter() {
  if (!impl_->finished) impl_->Abandon();
}

void VideoWriter::Impl::Add(const Image8& rgb, std::int64_t at) {
  if (rgb.channels != 3 || rgb.empty()) throw std::invalid_argument("VideoWriter: frames have 3 channels");
  if (!encoder && width > 0) throw std::logic_error("VideoWriter: no frames after Finish or a failure");
  CheckInterrupted();
  if (width == 0) {
    width = rgb.width;
    height = rgb.height;
    const VideoShape shape{width + width % 2, height + height % 2, fps, start_s ? kTicksPerSecond : 0};
    encoder = LoadVideoCodecs().encode(temporary, path, shape, ThreadCount());
  }
  if (rgb.width != width || rgb.height != height) throw std::invalid_argument("VideoWriter: frames of one size");
  try {
    if (rgb.width % 2 == 0 && rgb.height % 2 == 0) {
      encoder->Add(rgb, at);
    } else {
      // The last column and row once more, where the size is odd: chroma is shared by 2 x 2 pixels.
      Image8 padded(rgb.width + rgb.width % 2, rgb.height + rgb.height % 2, 3);
      for (int y = 0; y < padded.height; ++y) {
        const std::uint8_t* from = rgb.Row(std::min(y, rgb.height - 1));
        std::copy(from, from + 3 * rgb.width, padded.Row(y));
        if (rgb.width % 2) std::copy(from + 3 * (rgb.width - 1), from + 3 * rgb.width, padded.Row(y) + 3 * rgb.width);
      }
      encoder->Add(padded, at);
    }
  } catch (const Error&) {
    Abandon();
    throw;
  }
  tick = at;
}

void VideoWriter::Add(const Image8& rgb) {
  Impl& v = *impl_;
  if (v.start_s) throw std::logic_error("VideoWriter: frames have a time or none, not both");
  v.Add(rgb, v.tick + 1);
}

void VideoWriter::Add(const Image8& rgb, double time_s) {
  Impl& v = *impl_;
  if (!v.start_s && v.tick >= 0) throw std::logic_error("VideoWriter: frames have a time or none, not both");
  if (!v.start_s) v.start_s = time_s;
  const std::int64_t tick = std::llround((time_s - *v.start_s) * kTicksPerSecond);
  if (!(tick > v.tick)) throw std::invalid_argument("VideoWriter: times increase");
  v.Add(rgb, tick);
}

void VideoWriter::Finish() {
  Impl& v = *impl_;
  if (v.finished) return;
  if (!v.encoder) throw MachineError("no frame was given: there is no video to write", {}, v.path);
  try {
    v.encoder->Finish();
    ThrowIfMemoryRanOut();
  } catch (...) {
    v.Abandon();
    throw;
  }
  v.encoder.reset();
  std::error_code error;
  fs::rename(v.temporary, v.path, error);
  if (error) {
    v.Abandon();
    throw MachineError(fmt::format("cannot be written: {}", error.message()), "choose another output", v.path);
  }
  v.finished = true;
}

}  // namespace lumi
