#include "reconstruct/video_frames.h"

#include <fmt/format.h>

#include <map>
#include <set>

#include "reconstruct/keyframes.h"
#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/files/provenance.h"
#include "scene/files/video.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

// Frames encoded at once, at most.
constexpr std::size_t kBatch = 32;

// Writes the frames for which wanted(index) holds; returns their times.
template <typename Wanted>
std::map<int, double> WriteFrames(const fs::path& video, const fs::path& folder, long total, const std::string& task,
                                  Wanted&& wanted, ProgressSink& sink) {
  fs::create_directories(folder);
  VideoReader reader(video);
  std::map<int, double> times;
  std::vector<VideoFrame> batch;
  const std::size_t at_once = FramesAtOnce(reader.width(), reader.height(), kBatch);
  Progress progress(sink, task, total);
  const auto flush = [&] {
    ParallelEach(batch.size(), 1, [&](std::size_t i) {
      WriteImage(folder / FrameName(batch[i].index), batch[i].rgb, kFrameJpegQuality);
    });
    batch.clear();
  };
  for (int index = 0;; ++index) {
    if (!wanted(index)) {
      if (!reader.Skip()) break;
      continue;
    }
    auto frame = reader.Next();
    if (!frame) break;
    times[frame->index] = frame->time_s;
    batch.push_back(std::move(*frame));
    if (batch.size() >= at_once) flush();
    progress.Step();
  }
  flush();
  return times;
}

InputPhoto FramePhoto(int index, double time_s, int width_px, int height_px) {
  InputPhoto photo;
  photo.name = FrameName(index);
  photo.width_px = width_px;
  photo.height_px = height_px;
  photo.time_s = time_s;
  photo.frame_index = index;
  return photo;
}

// keyframes.json: what was chosen, and from what.
struct ChosenFrame {
  int index = 0;
  double time_s = 0;
};
void ListKeys(JsonKeys& j, ChosenFrame& f) { j("index", f.index, "time_s", f.time_s); }
struct ChosenFrames {
  std::string key;
  int width = 0, height = 0, video_frames = 0;
  std::vector<ChosenFrame> frames;
};
void ListKeys(JsonKeys& j, ChosenFrames& c) {
  j("key", c.key, "width", c.width, "height", c.height, "video_frames", c.video_frames, "frames", c.frames);
}

}  // namespace

std::string FrameName(int index) { return fmt::format("frame_{:06d}.jpg", index); }

Capture ExtractKeyframes(const ReconstructOptions& options, const fs::path& work_folder,
                         std::vector<std::string>* reused, ProgressSink& sink) {
  Capture capture;
  capture.folder = work_folder / "keyframes";
  capture.is_video = true;
  const fs::path list = work_folder / "keyframes.json";
  const std::string key = Fingerprint(options.input) + fmt::format(" keyframes {}", options.keyframes);
  std::error_code ec;
  ChosenFrames found;
  if (const auto json = fs::exists(list, ec) ? JsonKeys::Parse(ReadText(list)) : std::nullopt;
      json && json->Into(found) && found.key == key) {
    for (const ChosenFrame& f : found.frames)
      capture.photos.push_back(FramePhoto(f.index, f.time_s, found.width, found.height));
    capture.video_frames = found.video_frames;
    if (std::ranges::all_of(capture.photos,
                            [&](const InputPhoto& photo) { return fs::exists(capture.folder / photo.name, ec); })) {
      reused->push_back("keyframes");
      return capture;
    }
    capture.photos.clear();
  }

  const VideoStatistics video = AnalyseVideo(options.input, sink);
  capture.video_frames = static_cast<int>(video.frames.size());
  if (video.truncated)
    sink.Message(fmt::format("{} is cut off: its first {} frames are used", options.input.filename().string(),
                             video.frames.size()));
  KeyframeOptions choice;
  choice.count = options.keyframes;
  const std::vector<int> chosen = SelectKeyframes(video.frames, choice);
  if (chosen.size() < 2)
    throw DataError(fmt::format("the camera hardly moves in the {} frames of the video", video.frames.size()),
                    "a lumigraph needs photos from different places: walk while filming", options.input);
  fs::remove_all(capture.folder);
  const std::set<int> wanted(chosen.begin(), chosen.end());
  const auto times = WriteFrames(
      options.input, capture.folder, static_cast<long>(chosen.size()), "writing keyframes",
      [&](int i) { return wanted.count(i) > 0; }, sink);
  found = {key, video.width_px, video.height_px, capture.video_frames, {}};
  for (const auto& [index, time_s] : times) {
    capture.photos.push_back(FramePhoto(index, time_s, video.width_px, video.height_px));
    found.frames.push_back({index, time_s});
  }
  WriteTextAtomically(list, JsonKeys(found).Text(1));
  double moved = 0;
  for (const FrameStatistics& frame : video.frames) moved += frame.step;
  const double apart = moved / static_cast<double>(chosen.size() - 1);
  sink.Message(fmt::format(
      "{} keyframes of {} frames, {:.0f} % of a picture's width apart{}", capture.photos.size(), capture.video_frames,
      100 * apart,
      apart > choice.max_spacing ? ": neighbours may share too little (--keyframes N takes more of them)" : ""));
  return capture;
}

Capture ExtractAllFrames(const ReconstructOptions& options, const Capture& keyframes, const fs::path& folder,
                         ProgressSink& sink) {
  std::set<int> have;
  fs::create_directories(folder);
  std::error_code ec;
  for (const InputPhoto& photo : keyframes.photos) {
    have.insert(*photo.frame_index);
    fs::remove(folder / photo.name, ec);
    fs::create_hard_link(keyframes.folder / photo.name, folder / photo.name, ec);
    if (ec) fs::copy_file(keyframes.folder / photo.name, folder / photo.name);
  }
  const auto times = WriteFrames(
      options.input, folder, keyframes.video_frames, "writing all frames", [&](int i) { return have.count(i) == 0; },
      sink);
  Capture all = keyframes;
  all.folder = folder;
  for (const auto& [index, time_s] : times)
    all.photos.push_back(
        FramePhoto(index, time_s, keyframes.photos.front().width_px, keyframes.photos.front().height_px));
  std::ranges::sort(all.photos, [](const InputPhoto& a, const InputPhoto& b) { return a.name < b.name; });
  return all;
}

Capture ExtractEveryFrame(const ReconstructOptions& options, const fs::path& folder, ProgressSink& sink) {
  fs::remove_all(folder);
  Capture all;
  all.folder = folder;
  all.is_video = all.every_frame = true;
  int width = 0, height = 0;
  long count = 0;
  {
    const VideoReader reader(options.input);
    width = reader.width();
    height = reader.height();
    count = reader.frame_count_hint();
    for (const std::string& remark : reader.remarks()) sink.Message(remark);
  }
  for (const auto& [index, time_s] : WriteFrames(
           options.input, folder, count, "writing all frames", [](int) { return true; }, sink))
    all.photos.push_back(FramePhoto(index, time_s, width, height));
  all.video_frames = all.total();
  if (all.photos.size() < 2)
    throw DataError(fmt::format("the video has {} frame{}: nothing relates to it", all.photos.size(),
                                all.photos.size() == 1 ? "" : "s"),
                    "a video of two frames or more", options.input);
  return all;
}

}  // namespace lumi
