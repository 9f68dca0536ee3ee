#include "reconstruct/clips.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "reconstruct/multi_camera.h"
#include "reconstruct/video_frames.h"
#include "scene/files/video.h"
#include "scene/program/error.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kNeighboursInClip = 10;  // on each side, each; beyond them at distances 16, 32 ...
constexpr const char* kClipSetting = "clip ";  // before the clip's name, as a photo's camera

// As a photo under another name: the same file.
void Link(const fs::path& from, const fs::path& to) {
  std::error_code error;
  fs::create_directories(to.parent_path());
  fs::remove(to, error);
  fs::create_hard_link(from, to, error);
  if (!error) return;
  fs::copy_file(from, to, fs::copy_options::overwrite_existing, error);
  if (error) throw MachineError("cannot be written: " + error.message(), "is the disk full?", to);
}

}  // namespace

std::vector<fs::path> ClipsOf(const ReconstructOptions& options) {
  if (options.inputs.size() < 2) return SynchronisedVideos(options.input);
  for (const fs::path& clip : options.inputs) {
    std::error_code error;
    if (!fs::exists(clip, error)) throw InputError(clip, "no such file");
    if (!fs::is_regular_file(clip, error) || !HasVideoExtension(clip))
      throw UsageError(fmt::format("{} is no video: several inputs are videos of one place", clip.string()),
                       "put photos into one folder and give that; the output is -o SCENE");
  }
  return options.inputs;
}

Capture ExtractClips(const ReconstructOptions& options, const fs::path& work_folder, std::vector<std::string>* reused,
                     ProgressSink& sink) {
  const std::vector<fs::path> videos = ClipsOf(options);
  if (videos.size() < 2)
    throw UsageError(fmt::format("--clips: {} is no folder of two or more videos", options.input.string()),
                     "give a folder that holds the clips and no photos");
  Capture all;
  all.folder = work_folder / "clips";
  // a.mp4 and a.mov are two clips, and so are two files of one name in two folders.
  std::map<std::string, int> stems, names;
  for (const fs::path& video : videos) ++stems[video.stem().string()];
  std::size_t known = 0;
  for (const fs::path& video : videos) {
    ReconstructOptions one = options;
    one.input = video;
    const std::string stem = video.stem().string();
    std::string name = stems[stem] > 1 ? video.filename().string() : stem;
    if (const int same = ++names[name]; same > 1) name += fmt::format("={}", same);
    std::vector<std::string> kept;
    const Capture clip = ExtractKeyframes(one, work_folder / "clip-keyframes" / name, &kept, sink);
    known += kept.size();
    all.video_frames += clip.video_frames;
    for (InputPhoto photo : clip.photos) {
      const fs::path frame = clip.folder / photo.name;
      photo.name = name + "/" + photo.name;
      photo.camera = kClipSetting + name;
      photo.time_s.reset();
      photo.frame_index.reset();
      Link(frame, all.folder / photo.name);
      all.photos.push_back(std::move(photo));
    }
    sink.Message(fmt::format("{}: {} keyframes of {} frames", name, clip.photos.size(), clip.video_frames));
  }
  if (known == videos.size()) reused->push_back("keyframes");
  std::ranges::sort(all.photos, [](const InputPhoto& a, const InputPhoto& b) { return a.name < b.name; });
  return all;
}

std::vector<std::pair<int, int>> ClipPairs(const Capture& capture) {
  std::map<std::string, std::vector<int>> clips;
  for (std::size_t i = 0; i < capture.photos.size(); ++i) {
    if (!capture.photos[i].camera.starts_with(kClipSetting)) return {};
    clips[capture.photos[i].camera].push_back(static_cast<int>(i));
  }
  std::vector<std::pair<int, int>> pairs;
  for (const auto& [clip, frames] : clips)
    for (std::size_t i = 0; i < frames.size(); ++i)
      for (std::size_t d = 1; i + d < frames.size(); d = d < kNeighboursInClip ? d + 1 : d < 16 ? 16 : 2 * d)
        pairs.emplace_back(frames[i], frames[i + d]);
  return pairs;
}

}  // namespace lumi
