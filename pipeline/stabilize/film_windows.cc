#include "pipeline/stabilize/film_windows.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "scene/files/image_io.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

// What is rendered is made of these: a second compression must not show.
constexpr int kJpegQuality = 98;
constexpr std::size_t kBatch = 24;  // frames encoded at once, at most
constexpr double kLeastStep_s = 1e-6;

}  // namespace

FilmFacts LookAtFilm(const fs::path& video, ProgressSink& sink) {
  const VideoReader reader(video);
  for (const std::string& remark : reader.remarks()) sink.Message(remark);
  const VideoTimes times = ReadUsableTimes(video);
  if (times.times_made_up > 0)
    sink.Message(fmt::format("{}: {} frame{} of its own: a usual step stands there", video.filename().string(),
                             times.times_made_up, times.times_made_up == 1 ? " has no time" : "s have no time"));
  const VideoClock clock(times);
  FilmFacts facts{clock.fps(), clock, {}, reader.width(), reader.height(), times.has_sound};
  for (const double t : times.time_s) facts.time_s.push_back(clock.TimeOf(t));
  return facts;
}

std::string FilmFrameName(int index) { return fmt::format("frame_{:06d}.jpg", index); }

int FramesWithin(const std::vector<double>& time_s, int last, double seconds, double step_s) {
  const double end_s = time_s.at(static_cast<std::size_t>(last));
  int count = 1;
  while (count <= last && end_s - time_s[static_cast<std::size_t>(last - count)] < seconds - 0.5 * step_s) ++count;
  return count;
}

struct FilmFrames::Impl {
  Impl(const fs::path& video, const VideoClock& the_clock) : reader(video), clock(the_clock) {}
  std::optional<VideoFrame> Next() {
    std::optional<VideoFrame> frame = std::exchange(ahead, std::nullopt);
    if (!frame && !end) frame = reader.Next();
    end = !frame;
    return frame;
  }

  VideoReader reader;
  VideoClock clock;
  std::optional<VideoFrame> ahead;
  int next = 0;
  bool end = false;
  std::vector<double> time_s;
  std::map<int, fs::path> written;  // of the last window
};

FilmFrames::FilmFrames(const fs::path& video, const VideoClock& clock) : impl_(std::make_unique<Impl>(video, clock)) {}
FilmFrames::~FilmFrames() = default;
bool FilmFrames::AtEnd() {
  if (!impl_->ahead) impl_->ahead = impl_->Next();
  return !impl_->ahead;
}
const std::vector<double>& FilmFrames::time_s() const { return impl_->time_s; }

int FilmFrames::Write(int first, int count, const fs::path& folder, ProgressSink& sink) {
  fs::create_directories(folder);
  std::map<int, fs::path> now;
  std::vector<VideoFrame> batch;
  const std::size_t at_once = FramesAtOnce(impl_->reader.width(), impl_->reader.height(), kBatch);
  Progress progress(sink, "reading frames", count);
  const auto flush = [&] {
    ParallelEach(batch.size(), 1, [&](std::size_t i) {
      WriteImage(folder / FilmFrameName(batch[i].index), batch[i].rgb, kJpegQuality);
    });
    batch.clear();
  };
  int got = 0;
  for (int index = first; index < first + count; ++index) {
    const fs::path file = folder / FilmFrameName(index);
    if (index < impl_->next) {
      const auto before = impl_->written.find(index);
      if (before == impl_->written.end()) throw std::invalid_argument("FilmFrames::Write goes back too far");
      std::error_code ec;
      if (before->second != file) {
        fs::remove(file, ec);
        fs::create_hard_link(before->second, file, ec);
        if (ec) fs::copy_file(before->second, file);
      }
    } else {
      auto frame = impl_->Next();
      if (!frame) break;
      const double time_s = impl_->clock.TimeOf(frame->time_s);
      const bool later = impl_->time_s.empty() || time_s > impl_->time_s.back();
      impl_->time_s.push_back(later ? time_s : std::max(frame->time_s, impl_->time_s.back() + kLeastStep_s));
      frame->index = impl_->next++;
      if (std::error_code ec; !fs::exists(file, ec)) batch.push_back(std::move(*frame));
      if (batch.size() >= at_once) flush();
    }
    now[index] = file;
    ++got;
    progress.Step();
  }
  flush();
  impl_->written = std::move(now);
  return got;
}

}  // namespace lumi
