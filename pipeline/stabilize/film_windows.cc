#include "pipeline/stabilize/film_windows.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "scene/files/image_io.h"
#include "scene/files/video.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"
#include "scene/program/subprocess.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

// What is rendered is made of these: a second compression must not show.
constexpr int kJpegQuality = 98;
constexpr std::size_t kBatch = 24;  // frames encoded at once: bounds the memory

bool HasSound(const fs::path& video) {
  if (!FindProgram("ffprobe")) return false;
  SubprocessOptions options;
  options.separate_stdout = true;
  const SubprocessResult result = RunSubprocess({"ffprobe", "-v", "error", "-select_streams", "a", "-show_entries",
                                                 "stream=index", "-of", "csv=p=0", video.string()},
                                                options);
  return result.exit_code == 0 && !result.out.empty();
}

}  // namespace

FilmFacts LookAtFilm(const fs::path& video) {
  const VideoReader reader(video);
  FilmFacts facts;
  facts.fps = reader.fps();
  facts.width_px = reader.width();
  facts.height_px = reader.height();
  facts.frames_hint = reader.frame_count_hint();
  facts.sound = HasSound(video);
  return facts;
}

std::string FilmFrameName(int index) { return fmt::format("frame_{:06d}.jpg", index); }

struct FilmFrames::Impl {
  explicit Impl(const fs::path& video) : reader(video) {}
  std::optional<VideoFrame> Next() {
    std::optional<VideoFrame> frame = std::exchange(ahead, std::nullopt);
    if (!frame && !end) frame = reader.Next();
    end = !frame;
    return frame;
  }

  VideoReader reader;
  std::optional<VideoFrame> ahead;
  int next = 0;
  bool end = false;
  double last_time_s = 0, shortest_s = 0, longest_s = 0;
  std::map<int, fs::path> written;  // of the last window
};

FilmFrames::FilmFrames(const fs::path& video) : impl_(std::make_unique<Impl>(video)) {}
FilmFrames::~FilmFrames() = default;
int FilmFrames::decoded() const { return impl_->next; }
bool FilmFrames::AtEnd() {
  if (!impl_->ahead) impl_->ahead = impl_->Next();
  return !impl_->ahead;
}
std::pair<double, double> FilmFrames::Steps() const { return {impl_->shortest_s, impl_->longest_s}; }

int FilmFrames::Write(int first, int count, const fs::path& folder, ProgressSink& sink) {
  fs::create_directories(folder);
  std::map<int, fs::path> now;
  std::vector<VideoFrame> batch;
  Progress progress(sink, "reading frames", count);
  const auto flush = [&] {
    ParallelEach(batch.size(), 1, [&](std::size_t i) {
      WriteImage(folder / FilmFrameName(batch[i].index), batch[i].rgb, kJpegQuality);
    });
    batch.clear();
  };
  int got = 0;
  if (first == 0)
    for (const std::string& remark : impl_->reader.remarks()) sink.Message(remark);
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
      if (impl_->next > 0) {
        const double step = frame->time_s - impl_->last_time_s;
        impl_->shortest_s = impl_->next == 1 ? step : std::min(impl_->shortest_s, step);
        impl_->longest_s = std::max(impl_->longest_s, step);
      }
      impl_->last_time_s = frame->time_s;
      frame->index = impl_->next++;
      if (std::error_code ec; !fs::exists(file, ec)) batch.push_back(std::move(*frame));
      if (batch.size() == kBatch) flush();
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
