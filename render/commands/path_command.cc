// lumi-render along a path: frames as pictures and a video.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <string_view>
#include <tuple>

#include "render/commands/frames_in_progress.h"
#include "render/commands/render_job.h"
#include "render/path/camera_path.h"
#include "render/path/matrix_path.h"
#include "render/path/path_frames.h"
#include "render/picture/border_fill.h"
#include "render/picture/convert.h"
#include "render/settings_json.h"
#include "scene/files/atomic_file.h"
#include "scene/files/filled_in_parts.h"
#include "scene/files/image_io.h"
#include "scene/files/provenance.h"
#include "scene/files/scene_folder.h"
#include "scene/files/video_clock.h"
#include "scene/geometry/median.h"
#include "scene/program/error.h"
#include "scene/program/memory.h"
#include "scene/program/parallel.h"
#include "scene/program/registers.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace {

constexpr const char* kFilm = "path.mp4";  // beside the folder of its frames

CameraPath RequestedPath(const RenderJob& job) {
  const RenderOptions& o = job.options;
  return o.path.empty() ? PathThroughPhotos(job.scene(), o.seconds, o.fps) : ReadCameraPath(o.path);
}

// A film of the path. Frames come at an even rate; those of a path of matrices at the times of their keys or, with
// --fps, at that rate, where each picture of the film is the frame nearest in time.
class PathFilm {
 public:
  PathFilm(const std::filesystem::path& file, const RenderJob& job, double fps) {
    if (job.matrices)
      for (const MatrixKey& key : job.matrices->keys) times_s_.push_back(key.time_s);
    even_ = AreEven(times_s_, fps);
    const std::optional<double> asked =
        job.matrices && job.options.decided.Has("fps") ? std::optional(job.options.fps) : std::nullopt;
    if (asked && !AreEven(times_s_, *asked)) {
      shown_ = ShownAtRate(times_s_, FilmLength_s(times_s_, fps), *asked);
      even_ = true;
    }
    writer_.emplace(file, asked.value_or(fps));
  }
  void Add(std::size_t frame, const Image8& rgb) {
    for (int k = shown_.empty() ? 1 : shown_[frame]; k > 0; --k) {
      if (even_)
        writer_->Add(rgb);
      else
        writer_->Add(rgb, times_s_[frame] - times_s_[0]);
    }
  }
  void Finish() { writer_->Finish(); }

 private:
  std::vector<double> times_s_;
  std::vector<int> shown_;  // how often each frame is shown; empty: once
  bool even_ = true;
  std::optional<VideoWriter> writer_;
};

double FramesPerSecond(const RenderJob& job) { return job.matrices ? job.matrices->fps : RequestedPath(job).fps; }

ImageF Opaque(const Image8& rgb) {
  ImageF image(rgb.width, rgb.height, 4, 1.0F);
  for (int y = 0; y < rgb.height; ++y)
    for (int x = 0; x < rgb.width; ++x)
      for (int c = 0; c < 3; ++c) image.At(x, y, c) = static_cast<float>(rgb.At(x, y, c)) / 255.0F;
  return image;
}

// A frame read back over black, as ToRgb8 gives it when it is rendered (a JPEG: nearly). A PNG holds straight alpha;
// where holes were filled, it holds the colours as shown.
Image8 FrameOnDisk(const std::filesystem::path& file, bool filled) {
  if (file.extension() == ".exr") return ToRgb8(ReadImageF(file));
  if (filled) return ReadImage8(file);
  const Image8 rgba = ReadImage8(file, 4);
  Image8 rgb(rgba.width, rgba.height, 3);
  for (int y = 0; y < rgb.height; ++y)
    for (int x = 0; x < rgb.width; ++x)
      for (int c = 0; c < 3; ++c)
        rgb.At(x, y, c) = static_cast<std::uint8_t>((rgba.At(x, y, c) * rgba.At(x, y, 3) + 127) / 255);
  return rgb;
}

// Text of everything the frames depend on. Frames whose text differs are not kept.
std::string FrameFingerprint(const RenderJob& job, double fps) {
  const RenderOptions& o = job.options;
  const Lumigraph& l = job.lumigraph;
  const Scene& scene = job.scene();
  const Eigen::Vector2i size = job.wanted.views.front().size_px;
  std::string text =
      fmt::format("settings {}\nown_times {} backend {} show {} of {} size {} {} fps {}\n",
                  JsonKeys(l.settings()).Text(), l.own_times(), o.backend, o.show, o.of, size.x(), size.y(), fps);
  // The last digits depend on the register width: frames made with different widths are not joined.
  text += o.backend == "gl" ? fmt::format("device {}\n", job.renderer->Device())
                            : fmt::format("registers of {} bits\n", 8 * WidestRegister());
  text += l.cache() != nullptr ? "photos read as large as they are seen\n" : "photos all in memory\n";
  text += fmt::format("window_frames {} border {} {} nominal_focal_px {}\n", l.reach(), o.border.fill, o.border.reach,
                      o.nominal_focal_px);
  text += fmt::format("cameras {}\nlumigraph.json {}\nproxy {}\n",
                      Fingerprint(scene.folder / (l.metric() ? "sparse" : "projective.json")),
                      Fingerprint(scene.folder / "lumigraph.json"),
                      l.one_mesh() ? Fingerprint(ProxyFile(scene, l.proxy_name())) : l.proxy_name());
  // As read: workspaces have their cameras in other places too (transforms.json, cameras.bin without sparse/).
  for (const View& v : scene.views) {
    text += fmt::format("camera of {}", v.name);
    const RenderView own = MakeRenderView(scene, v);
    for (int i = 0; i < 12; ++i) text += fmt::format(" {}", own.P(i / 4, i % 4));
    text += '\n';
  }
  // Only the photos, not their folder: it may hold these frames, too.
  for (const View& v : scene.views)
    text += fmt::format("photo {} {}\n", v.name, FingerprintAmong(scene.ImagePath(v), scene.views.size()));
  for (const RenderView& v : job.wanted.views) {
    text += fmt::format("frame {} {}", v.time_s ? fmt::format("{}", *v.time_s) : "-", v.gain);
    for (int i = 0; i < 12; ++i) text += fmt::format(" {}", v.P(i / 4, i % 4));
    text += '\n';
  }
  return text;
}

// Removes frames that a power failure left incomplete.
void RemoveDamaged(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> frames;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (HasImageExtension(entry.path())) frames.push_back(entry.path());
  for (const std::filesystem::path& frame : frames) {
    try {
      frame.extension() == ".exr" ? (void)ReadImageF(frame) : (void)ReadImage8(frame);
    } catch (const InputError&) {
      std::filesystem::remove(frame);
    }
  }
}

bool IsFrame(const std::filesystem::path& file) { return HasImageExtension(file); }

// How the texts of two runs' frames differ first, in words.
std::string Difference(const std::string& there, const std::string& here) {
  auto [one, other] = FirstDifference(there, here, "\n");
  const auto begins = [&](std::string_view word) { return one.starts_with(word) && other.starts_with(word); };
  // What follows is a hash, or a camera's numbers.
  for (const char* word : {"cameras", "lumigraph.json", "proxy"})
    if (begins(word)) return fmt::format("other {}", word);
  if (begins("photo ")) return "another " + one.substr(0, one.rfind(' '));
  if (one.starts_with("frame ") || other.starts_with("frame ")) return "another path";
  if (begins("settings ")) std::tie(one, other) = FirstDifference(one, other, ",");
  return ThereAndHere(one, other);
}

FilledInParts FramesIn(const std::filesystem::path& folder) {
  return {folder,  "frames.txt", "frames",
          IsFrame, Difference,   "give all parts the same scene, path, settings and kind of machine, or another -o"};
}

// Keeps frames that an earlier run with the same scene, path and settings finished. Removes others, unless they were
// made in parts: then it refuses.
void KeepOrClear(const std::filesystem::path& folder, const std::filesystem::path& film, const std::string& wanted) {
  const FilledInParts frames = FramesIn(folder);
  if (frames.Keeps(wanted)) {
    // Frames made in parts may come from other machines, which this machine's restart did not interrupt.
    if (RestartedSince(folder) && !frames.MadeInParts()) RemoveDamaged(folder);
    NoteRunOfMachine(folder);
    return;
  }
  std::error_code ec;
  std::filesystem::remove_all(folder, ec);
  std::filesystem::remove(film, ec);  // made of the frames that were removed
  std::filesystem::create_directories(folder);
  NoteRunOfMachine(folder);
  frames.Stamp(wanted);
}

}  // namespace

// Frames coded at the same time, in a sixteenth of the memory that there is: on half of the cores, because drawing on a
// processor takes all of them.
static std::size_t FramesAtOnce(const RenderJob& job, const Eigen::Vector2i& size_px) {
  constexpr std::uint64_t kBytesAPixel = 4 * sizeof(float) + 4 + 3;  // as it was drawn, as PNG and as the film take it
  const RenderOptions& o = job.options;
  const std::uint64_t memory = o.memory_mb > 0 ? static_cast<std::uint64_t>(o.memory_mb) << 20 : AvailableMemory();
  const std::uint64_t bytes = kBytesAPixel * static_cast<std::uint64_t>(size_px.cast<std::int64_t>().prod());
  const int cores = std::max(1, ThreadCount() / 2);
  return static_cast<std::size_t>(std::clamp<std::uint64_t>(memory / 16 / bytes, 1, static_cast<std::uint64_t>(cores)));
}

// The range [first, second) of a path's frames that --frames or --shard asks for.
static std::pair<std::size_t, std::size_t> PartOf(const RenderOptions& o, std::size_t frames) {
  if (o.frames) {
    if (o.frames->last >= frames)
      throw UsageError(fmt::format("the path has frames 0 to {}, and --frames asks for {} to {}", frames - 1,
                                   o.frames->first, o.frames->last));
    return {o.frames->first, o.frames->last + 1};
  }
  if (!o.shard) return {0, frames};
  const Part::Range range = o.shard->RangeOf(frames);
  return {range.begin, range.end};
}

DesiredViews FramesWanted(const RenderJob& job) {
  const RenderOptions& o = job.options;
  return {job.matrices ? FramesOfPath(job.scene(), *job.matrices, o.width_px, o.height_px)
                       : FramesOfPath(job.scene(), RequestedPath(job), o.width_px, o.height_px),
          {}};
}

void RenderPath(RenderJob& job) {
  const RenderOptions& o = job.options;
  const std::vector<RenderView>& views = job.wanted.views;
  const double fps = FramesPerSecond(job);
  const auto [begin, end] = PartOf(o, views.size());
  const std::filesystem::path frames = o.output / "frames";
  if (o.part_of_path())
    FramesIn(frames).Join(FrameFingerprint(job, fps));
  else if (!o.to_video())
    KeepOrClear(frames, o.output / kFilm, FrameFingerprint(job, fps));
  std::optional<PathFilm> video;
  const std::filesystem::path video_file = o.to_video() ? o.output : o.output / kFilm;
  std::optional<FolderInUse> in_use;
  if (o.to_video() || o.video) {
    video.emplace(video_file, job, fps);
    in_use.emplace(video_file.parent_path());
  }

  PathFigures& figures = job.summary.path.emplace();
  figures.size_px = views.front().size_px;
  figures.widened = o.border.fill && !job.lumigraph.one_mesh();
  Progress progress(job.sink, "rendering frames", static_cast<long>(end - begin));
  std::vector<double> times;
  double seen = 0, window = 0, wider = 0;
  const auto film = [&](std::size_t i, Image8 rgb) {
    if (video) video->Add(i, rgb);
  };
  // Last, and so the first to end: frames in progress refer to all of the above.
  FramesInProgress coded(FramesAtOnce(job, figures.size_px), ThreadCount() > 1);
  for (std::size_t i = begin; i < end; ++i) {
    const std::filesystem::path stem = o.output / "frames" / fmt::format("frame_{:06}", i),
                                file = stem.string() + "." + o.format;
    if (!o.to_video() && std::filesystem::exists(file)) {
      ++figures.reused;
      if (video)
        coded.Add([&, file] { return FrameOnDisk(file, job.Fills()); },
                  [&, i](Image8 rgb) { film(i, std::move(rgb)); });
      progress.Step();
      continue;
    }
    RenderRequest request = job.Request(views[i]);
    request.use = job.lumigraph.InWindow(request.view, {});
    const auto start = std::chrono::steady_clock::now();
    ImageF image = o.show == "cameras" ? Opaque(job.CamerasAround(request.view)) : job.Picture(request);
    // Which photos are in graphics memory depends on the frames before.
    const bool depends = o.backend == "gl" && job.lumigraph.cache() != nullptr;
    if (job.most_halved > 0 || depends) {
      if (o.part_of_path())
        throw MachineError("a picture's photos do not fit into memory here, and a part's are as sharp as the whole's",
                           "give more --memory-mb");
      // Without the stamp, a later run with more memory renders these frames again.
      if (std::error_code ignored; !o.to_video()) std::filesystem::remove(FramesIn(frames).stamp(), ignored);
    }
    seen += Coverage(image);
    if (job.Fills()) FillAndMark(image);
    times.push_back(1000 * SecondsSince(start));
    const RenderStatistics statistics = job.renderer->Statistics();
    window += statistics.window_coverage;
    wider += statistics.wider_coverage;
    coded.Add(
        [&, stem, image = std::move(image)] {
          if (!o.to_video()) job.Write(stem, image);
          return video ? ToRgb8(image) : Image8();
        },
        [&, i](Image8 rgb) { film(i, std::move(rgb)); });
    progress.Step();
  }
  coded.Finish();
  if (video) {
    video->Finish();
    figures.video = video_file.generic_string();
  }
  job.summary.wrote = video ? video_file : frames;
  job.summary.frames = static_cast<long>(end - begin);
  if (times.empty()) return;
  const auto n = static_cast<double>(times.size());
  job.summary.coverage = seen / n;
  figures.coverage_window = window / n;
  figures.coverage_wider = wider / n;
  figures.ms_first = times.front();
  if (times.size() > 1) figures.ms_slowest = *std::ranges::max_element(times.begin() + 1, times.end());
  job.summary.ms_per_frame = Median(times);
}

}  // namespace lumi
