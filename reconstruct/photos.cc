#include "reconstruct/photos.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <map>

#include "reconstruct/photo_names.h"
#include "scene/files/image_io.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

// Some cameras append previews or maker data after the picture; the end marker is searched this far from the end.
constexpr std::streamoff kTailBytes = 64;

std::vector<std::uint8_t> ReadRange(const fs::path& path, std::streamoff from_end, std::streamoff from_begin,
                                    std::size_t n) {
  std::ifstream file(path, std::ios::binary);
  std::vector<std::uint8_t> bytes(n);
  if (from_end > 0) {
    file.seekg(0, std::ios::end);
    const std::streamoff size = file.tellg();
    file.seekg(std::max<std::streamoff>(0, size - from_end));
  } else {
    file.seekg(from_begin);
  }
  file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(n));
  bytes.resize(static_cast<std::size_t>(std::max<std::streamsize>(0, file.gcount())));
  return bytes;
}

bool IsJpeg(const std::vector<std::uint8_t>& head) { return head.size() > 2 && head[0] == 0xFF && head[1] == 0xD8; }
bool IsPng(const std::vector<std::uint8_t>& head) {
  constexpr std::array<std::uint8_t, 4> kPng{0x89, 'P', 'N', 'G'};
  return head.size() >= 26 && std::equal(kPng.begin(), kPng.end(), head.begin());
}

// Whether the file ends as its format says; false means "decode it to know".
bool EndsAsItShould(const fs::path& path, const std::vector<std::uint8_t>& head) {
  const auto tail = ReadRange(path, kTailBytes, 0, static_cast<std::size_t>(kTailBytes));
  if (IsJpeg(head)) {
    std::size_t end = tail.size();
    while (end > 0 && tail[end - 1] == 0) --end;  // padding
    return end >= 2 && tail[end - 2] == 0xFF && tail[end - 1] == 0xD9;
  }
  if (IsPng(head)) {
    constexpr std::array<std::uint8_t, 4> kEnd{'I', 'E', 'N', 'D'};
    return std::search(tail.begin(), tail.end(), kEnd.begin(), kEnd.end()) != tail.end();
  }
  return false;
}

// COLMAP reads through FreeImage and turns away what is not 8 bits or is grey with alpha.
bool ColmapReads(const std::vector<std::uint8_t>& head) {
  if (IsJpeg(head)) return true;
  if (IsPng(head)) return head[24] <= 8 && head[25] != 4;  // IHDR: bit depth, colour type
  const std::string text(head.begin(), head.end());
  return text.rfind("BM", 0) == 0 || (text.rfind("RIFF", 0) == 0 && text.substr(8, 4) == "WEBP");
}

std::string Listing(const std::vector<std::string>& names) {
  constexpr std::size_t kShown = 3;
  std::string text;
  for (std::size_t i = 0; i < std::min(kShown, names.size()); ++i) text += (i ? ", " : "") + names[i];
  if (names.size() > kShown) text += ", ...";
  return text;
}

}  // namespace

Capture FindPhotos(const fs::path& folder, ProgressSink& sink) {
  std::error_code ec;
  if (!fs::exists(folder, ec)) throw InputError(folder, "no such folder");
  if (!fs::is_directory(folder, ec))
    throw InputError(folder, "neither a folder of photos nor a video", "give a folder of photos, or a video file");

  Capture capture;
  capture.folder = folder;
  std::vector<std::string> names;
  for (auto it = fs::recursive_directory_iterator(folder, fs::directory_options::follow_directory_symlink, ec);
       !ec && it != fs::recursive_directory_iterator(); it.increment(ec)) {
    const std::string file = it->path().filename().string();
    if (file.starts_with(".")) {  // hidden, and what desktops leave behind
      if (it->is_directory(ec)) it.disable_recursion_pending();
      continue;
    }
    if (!it->is_regular_file(ec)) continue;
    const std::string name = it->path().lexically_relative(folder).generic_string();
    (HasImageExtension(it->path()) ? names : capture.ignored).push_back(name);
  }
  if (ec) throw InputError(folder, "cannot be read: " + ec.message());
  std::ranges::sort(names);
  std::ranges::sort(capture.ignored);
  if (names.empty()) {
    throw InputError(folder,
                     capture.ignored.empty() ? "the folder is empty"
                                             : fmt::format("no photo among its {} files ({})", capture.ignored.size(),
                                                           Listing(capture.ignored)),
                     "give a folder of JPEG, PNG, TIFF or HEIC photos");
  }
  if (!capture.ignored.empty())
    sink.Message(fmt::format("ignored {} file{} that {} no photo{}: {}", capture.ignored.size(),
                             capture.ignored.size() == 1 ? "" : "s", capture.ignored.size() == 1 ? "is" : "are",
                             capture.ignored.size() == 1 ? "" : "s", Listing(capture.ignored)));

  std::vector<InputPhoto> photos(names.size());
  std::vector<std::string> reasons(names.size());
  Progress progress(sink, "checking photos", static_cast<long>(names.size()));
  ParallelEach(names.size(), 1, [&](std::size_t i) {
    const fs::path path = folder / names[i];
    try {
      const ImageInfo info = ReadImageInfo(path);
      const auto head = ReadRange(path, 0, 0, 32);
      if (!EndsAsItShould(path, head)) ReadImage8(path);  // throws for half a photograph
      photos[i].name = names[i];
      photos[i].width_px = info.width;
      photos[i].height_px = info.height;
      photos[i].focal_35mm = info.focal_35mm;
      photos[i].needs_conversion = !ColmapReads(head);
    } catch (const Interrupted&) {
      throw;
    } catch (const Error& e) {
      reasons[i] = e.what();
    }
    progress.Step();
  });
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (reasons[i].empty())
      capture.photos.push_back(photos[i]);
    else
      capture.unreadable.push_back(
          {names[i], "unreadable: " + reasons[i], "copy it from the camera again, or leave it out"});
  }
  for (const auto& bad : capture.unreadable) sink.Message(fmt::format("left out {}: {}", bad.name, bad.reason));
  return capture;
}

// Whether any photo is called otherwise in the scene.
static bool NameForScene(Capture& staged, ProgressSink& sink) {
  std::vector<std::string> names;
  for (const InputPhoto& photo : staged.photos) names.push_back(photo.name);
  const std::vector<std::string> scene_names = SceneNames(names);
  int renamed = 0;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (scene_names[i] == names[i]) continue;
    if (++renamed == 1)
      sink.Message(
          fmt::format("the photo \"{}\" is called {} in the scene: its name has control characters, outer "
                      "blanks, bytes that are no UTF-8, or more than 200 bytes",
                      names[i], scene_names[i]));
    staged.photos[i].given_name = names[i];
    staged.photos[i].name = scene_names[i];
  }
  if (renamed > 1) sink.Message(fmt::format("so are {} more", renamed - 1));
  return renamed > 0;
}

Capture StageForColmap(const Capture& capture, const fs::path& staging, ProgressSink& sink) {
  Capture staged = capture;
  staged.folder = staging;
  if (!NameForScene(staged, sink) &&
      std::ranges::none_of(capture.photos, [](const InputPhoto& p) { return p.needs_conversion; }))
    return capture;
  Progress progress(sink, "converting photos that COLMAP cannot read", static_cast<long>(capture.photos.size()));
  ParallelEach(staged.photos.size(), 1, [&](std::size_t i) {
    InputPhoto& photo = staged.photos[i];
    const fs::path source = fs::absolute(capture.folder / capture.photos[i].name);
    if (photo.needs_conversion) photo.name += ".png";
    const fs::path target = staging / photo.name;
    fs::create_directories(target.parent_path());
    std::error_code ec;
    if (photo.needs_conversion) {
      if (!fs::exists(target, ec) || fs::last_write_time(target, ec) < fs::last_write_time(source, ec))
        WriteImage(target, ReadImage8(source));
    } else if (!fs::is_symlink(target, ec) || fs::read_symlink(target, ec) != source) {
      fs::remove(target, ec);
      fs::create_symlink(source, target);
    }
    progress.Step();
  });
  std::ranges::sort(staged.photos, [](const InputPhoto& a, const InputPhoto& b) { return a.name < b.name; });
  return staged;
}

void NumberFrames(Capture& capture, double fps) {
  for (InputPhoto& photo : capture.photos) {
    const std::string stem = fs::path(photo.name).stem().string();
    const std::size_t first = stem.find_last_not_of("0123456789") + 1;  // npos + 1 = 0
    if (first >= stem.size() || stem.size() - first > 9)
      throw DataError(photo.name + " does not end in a frame number",
                      "name the frames frame_000000.jpg ..., or leave out --fps", capture.folder / photo.name);
    photo.frame_index = std::stoi(stem.substr(first));
    photo.time_s = *photo.frame_index / fps;
  }
}

void CopyTimes(const Capture& capture, Scene& scene) {
  std::map<std::string, const InputPhoto*> photo_of;
  for (const InputPhoto& photo : capture.photos) photo_of[photo.name] = &photo;
  for (View& view : scene.views) {
    const auto it = photo_of.find(view.name);
    if (it == photo_of.end()) continue;
    view.time_s = it->second->time_s;
    view.frame_index = it->second->frame_index;
  }
}

}  // namespace lumi
