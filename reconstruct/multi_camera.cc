#include "reconstruct/multi_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "reconstruct/epipolar_synchronise.h"
#include "reconstruct/keyframes.h"
#include "reconstruct/synchronise.h"
#include "reconstruct/video_frames.h"
#include "scene/files/image_io.h"
#include "scene/files/video.h"
#include "scene/program/error.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

// Movement of the median corner from frame to frame, of the image's width, on average: what tracking and coding make of
// a camera that stands is a third of it.
constexpr double kStandsStill = 3e-4;
constexpr double kSameRate = 1e-3;

std::string PhotoName(const fs::path& video) { return video.stem().string() + ".jpg"; }

double MeanStep(const VideoStatistics& video) {
  double sum = 0;
  for (const FrameStatistics& f : video.frames) sum += f.step;
  return sum / static_cast<double>(video.frames.size());
}

}  // namespace

std::vector<fs::path> SynchronisedVideos(const fs::path& folder) {
  std::vector<fs::path> videos;
  std::error_code error;
  if (!fs::is_directory(folder, error)) return {};
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (!entry.is_regular_file(error)) continue;
    if (entry.path().filename().string().starts_with('.')) continue;  // what desktops leave behind
    if (HasVideoExtension(entry.path()))
      videos.push_back(entry.path());
    else if (HasImageExtension(entry.path()))
      return {};
  }
  std::ranges::sort(videos);
  return videos.size() < 2 ? std::vector<fs::path>() : videos;
}

MultiCapture OpenMultiCapture(const ReconstructOptions& options, const fs::path& work_folder, ProgressSink& sink) {
  MultiCapture capture;
  capture.videos = SynchronisedVideos(options.input);
  const std::size_t n = capture.videos.size();
  for (const fs::path& video : capture.videos) {
    capture.clocks.emplace_back(ReadUsableTimes(video));
    // Rates that differ in their last digits only are one: the last video's.
    const double fps = capture.clocks.back().fps();
    if (fps > (1 - kSameRate) * capture.fps) capture.fps = fps;
  }
  std::vector<std::vector<double>> times;  // of each video's frames, in frames of the common clock
  std::vector<int> frames;                 // of the common clock that each video shows
  for (std::size_t v = 0; v < n; ++v) {
    const fs::path& video = capture.videos[v];
    const VideoStatistics s = AnalyseVideo(video, sink);
    if (MeanStep(s) > kStandsStill)
      throw DataError(fmt::format("the camera of {} moves", video.filename().string()),
                      "several videos at once are for fixed cameras; clips taken one after the other: --clips", video);
    for (std::vector<double>& of = times.emplace_back(); const FrameStatistics& frame : s.frames)
      of.push_back(CommonFrame(capture.clocks[v], frame.time_s, capture.fps));
    frames.push_back(static_cast<int>(std::lround(times.back().back())) + 1);
    capture.moment.video_frames += static_cast<int>(s.frames.size());
  }
  if (!options.offsets_frames.empty()) {
    if (options.offsets_frames.size() != n)
      throw UsageError(fmt::format("--offsets-frames has {} numbers for {} videos", options.offsets_frames.size(), n),
                       "one a video, in the order of their names");
    capture.offsets = options.offsets_frames;
    const int least = *std::ranges::min_element(capture.offsets);
    for (int& offset : capture.offsets) offset -= least;
  } else {
    std::vector<MotionSignal> signals;
    for (std::size_t v = 0; v < n; ++v)
      signals.push_back(MeasureMotion(capture.videos[v], capture.clocks[v], capture.fps, sink));
    const Synchronisation found = Synchronise(signals, capture.videos);
    capture.offsets = found.offsets;
    std::string text;
    for (const int offset : found.offsets) text += (text.empty() ? "" : ", ") + std::to_string(offset);
    sink.Message(
        fmt::format("{} videos of one scene start at frames {} of a common clock (correlation {:.2f} or more){}", n,
                    text, found.least_correlation,
                    found.repeats ? "; as the scene repeats itself, whole periods more would do as well" : ""));
  }
  int first = 0, last = frames.front() + capture.offsets.front();
  for (std::size_t v = 0; v < n; ++v) {
    first = std::max(first, capture.offsets[v]);
    last = std::min(last, capture.offsets[v] + frames[v]);
  }
  if (last <= first)
    throw DataError("there is no moment that all videos show", "check --offsets-frames", options.input);
  const int moment = (first + last) / 2;
  capture.moment.folder = work_folder / "moment";
  fs::remove_all(capture.moment.folder);
  Progress progress(sink, "one moment of every video", static_cast<long>(n));
  for (std::size_t v = 0; v < n; ++v) {
    const auto distance = [at = moment - capture.offsets[v]](double frame) { return std::abs(frame - at); };
    const int wanted = static_cast<int>(std::ranges::min_element(times[v], {}, distance) - times[v].begin());
    VideoReader reader(capture.videos[v]);
    for (int i = 0; i < wanted; ++i) reader.Skip();
    const auto frame = reader.Next();
    if (!frame) throw InputError(capture.videos[v], fmt::format("frame {} cannot be read", wanted));
    InputPhoto photo;
    photo.name = PhotoName(capture.videos[v]);
    photo.width_px = frame->rgb.width;
    photo.height_px = frame->rgb.height;
    WriteImage(capture.moment.folder / photo.name, frame->rgb, kFrameJpegQuality);
    capture.moment.photos.push_back(photo);
    capture.moment_frame.push_back(wanted);
    progress.Step();
  }
  return capture;
}

void RefineWithCameras(MultiCapture& capture, const Scene& scene, ProgressSink& sink) {
  // Of long videos a part that all show; two of them may share more.
  const int begin = std::max(0, *std::ranges::max_element(capture.offsets) - kWatchedFrames / 4);
  std::vector<WatchedMotion> motions;
  std::vector<std::size_t> placed;
  std::vector<int> offsets;
  for (std::size_t v = 0; v < capture.videos.size(); ++v)
    for (const View& view : scene.views)
      if (view.name == PhotoName(capture.videos[v])) {
        const int first = std::max(0, begin - capture.offsets[v]);
        motions.push_back(WatchMotion(capture.videos[v], capture.clocks[v], capture.fps, first, scene.CameraOf(view),
                                      view.cam_from_world, sink));
        placed.push_back(v);
        offsets.push_back(capture.offsets[v] + first);
      }
  const OffsetCorrections corrections = CorrectOffsets(motions, offsets);
  if (!(corrections.correlation > 0)) return;
  for (std::size_t i = 0; i < placed.size(); ++i) capture.offsets[placed[i]] += corrections.frames[i];
  const int least = *std::ranges::min_element(capture.offsets);
  std::string text;
  for (int& offset : capture.offsets) {
    offset -= least;
    text += (text.empty() ? "" : ", ") + std::to_string(offset);
  }
  sink.Message(fmt::format(
      "with the cameras known, the videos start at frames {} (correlation {:.2f} in the planes of two cameras)", text,
      corrections.correlation));
}

void ExpandFrames(Scene& scene, const MultiCapture& capture, const ReconstructOptions& options, const fs::path& folder,
                  ReconstructSummary& summary, ProgressSink& sink) {
  std::vector<View> views;
  std::vector<ViewId> moment_view(scene.views.size());
  Progress progress(sink, "writing the frames of every video", capture.moment.video_frames);
  fs::remove_all(folder);
  int total = 0;
  for (std::size_t v = 0; v < capture.videos.size(); ++v) {
    const auto of_camera =
        std::ranges::find_if(scene.views, [&](const View& view) { return view.name == PhotoName(capture.videos[v]); });
    VideoReader reader(capture.videos[v]);
    for (int index = 0;; ++index) {
      const bool wanted = index == capture.moment_frame[v] || index % options.frame_step == 0;
      if (of_camera == scene.views.end() || !wanted) {
        if (!reader.Skip()) break;
        total += wanted;
        continue;
      }
      const auto frame = reader.Next();
      if (!frame) break;
      ++total;
      View view = *of_camera;
      view.name = capture.videos[v].stem().string() + "/" + FrameName(index);
      view.frame_index = index;
      view.time_s = capture.clocks[v].TimeOf(frame->time_s) + capture.offsets[v] / capture.fps;
      if (index == capture.moment_frame[v])
        moment_view[static_cast<std::size_t>(of_camera - scene.views.begin())] = {
            static_cast<std::int32_t>(views.size())};
      WriteImage(folder / view.name, frame->rgb, kFrameJpegQuality);
      views.push_back(std::move(view));
      progress.Step();
    }
  }
  for (Point& point : scene.points)
    for (Observation& o : point.track) o.view = moment_view[static_cast<std::size_t>(o.view.value)];
  scene.views = std::move(views);
  scene.image_folder = folder;
  summary.images_total = total;
}

}  // namespace lumi
