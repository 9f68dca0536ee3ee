#include "reconstruct/photos.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <fstream>
#include <map>
#include <set>

#include "reconstruct/photo_names.h"
#include "scene/files/image_io.h"
#include "scene/files/open_to_read.h"
#include "scene/files/video.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

// Some cameras append previews or maker data after the picture; the end marker is searched this far from the end.
constexpr std::streamoff kTailBytes = 64;

std::vector<std::uint8_t> ReadRange(const fs::path& path, std::streamoff from_end, std::streamoff from_begin,
                                    std::size_t n) {
  std::ifstream file = OpenToRead(path);
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

constexpr int kJpegQuality = 97;  // of copies: a second compression must not show

std::string Listing(const std::vector<std::string>& names) {
  constexpr std::size_t kShown = 3;
  std::string text;
  for (std::size_t i = 0; i < std::min(kShown, names.size()); ++i) text += (i ? ", " : "") + names[i];
  if (names.size() > kShown) text += ", ...";
  return text;
}

std::string Lower(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::string LowerStem(const std::string& name) { return Lower(fs::path(name).replace_extension().generic_string()); }

// RAW files beside the JPEG (or HEIC ...) of the same shot would be the same photo twice; where this machine reads
// none, all are left out.
void LeaveOutRaw(std::vector<std::string>& names, std::vector<std::string>& ignored, ProgressSink& sink) {
  if (std::ranges::none_of(names, [](const std::string& name) { return HasRawExtension(name); })) return;
  const bool readable = CanReadRaw();
  std::set<std::string> developed;
  for (const std::string& name : names)
    if (!HasRawExtension(name)) developed.insert(LowerStem(name));
  std::vector<std::string> kept, twice, unread;
  for (const std::string& name : names) {
    const bool raw = HasRawExtension(name), again = raw && developed.contains(LowerStem(name));
    (again ? twice : raw && !readable ? unread : kept).push_back(name);
  }
  if (!twice.empty())
    sink.Message(fmt::format("left out {} RAW file{} beside the picture{} of the same name: {}", twice.size(),
                             twice.size() == 1 ? "" : "s", twice.size() == 1 ? "" : "s", Listing(twice)));
  if (!unread.empty())
    sink.Message(
        fmt::format("left out {} RAW file{} (this OpenImageIO was built without LibRaw: develop them to JPEG "
                    "or TIFF): {}",
                    unread.size(), unread.size() == 1 ? "" : "s", Listing(unread)));
  names = std::move(kept);
  ignored.insert(ignored.end(), unread.begin(), unread.end());
}

InputPhoto AsPhoto(const std::string& name, const ImageInfo& info) {
  InputPhoto photo;
  photo.name = name;
  photo.width_px = info.width;
  photo.height_px = info.height;
  photo.focal_35mm = info.focal_35mm;
  photo.focal_mm = info.focal_mm;
  photo.gps = info.gps;
  photo.camera = info.make.empty() ? info.model : info.make + " " + info.model;
  photo.lens = info.lens;
  photo.projection = info.projection;
  photo.panorama = info.panorama;
  photo.orientation = info.orientation;
  return photo;
}

bool MayBeListed(const fs::path& folder) {
  std::error_code error;
  return fs::directory_iterator(folder, error) != fs::directory_iterator() || !error;
}

MissingPhoto Unreadable(const std::string& name, const std::string& why) {
  return {name, "unreadable: " + why, "copy it from the camera again, or leave it out"};
}

}  // namespace

std::string LensSetting(const InputPhoto& photo) {
  return fmt::format("{} | {} | {} | {}", photo.focal_35mm.value_or(0), photo.focal_mm.value_or(0), photo.camera,
                     photo.lens);
}

Capture FindPhotos(const fs::path& folder, ProgressSink& sink) {
  std::error_code ec;
  if (!fs::exists(folder, ec)) throw InputError(folder, "no such folder");
  if (!fs::is_directory(folder, ec))
    throw InputError(folder, "neither a folder of photos nor a video", "give a folder of photos, or a video file");

  Capture capture;
  capture.folder = folder;
  std::vector<std::string> names, closed;
  constexpr auto kFollowAndSkip =
      fs::directory_options::follow_directory_symlink | fs::directory_options::skip_permission_denied;
  for (auto it = fs::recursive_directory_iterator(folder, kFollowAndSkip, ec);
       !ec && it != fs::recursive_directory_iterator(); it.increment(ec)) {
    const std::string file = it->path().filename().string();
    const bool is_folder = it->is_directory(ec);
    if (file.starts_with(".")) {  // hidden, and what desktops leave behind
      if (is_folder) it.disable_recursion_pending();
      continue;
    }
    if (is_folder && !MayBeListed(it->path())) closed.push_back(it->path().lexically_relative(folder).generic_string());
    if (!it->is_regular_file(ec)) continue;
    const std::string name = it->path().lexically_relative(folder).generic_string();
    (HasImageExtension(it->path()) ? names : capture.ignored).push_back(name);
  }
  if (ec) throw InputError(folder, "cannot be read: " + ec.message());
  if (!closed.empty())
    sink.Message(fmt::format("left out what is in {} folder{} that this user may not read: {}", closed.size(),
                             closed.size() == 1 ? "" : "s", Listing(closed)));
  std::ranges::sort(names);
  std::ranges::sort(capture.ignored);
  std::vector<std::string> no_photos = capture.ignored;
  LeaveOutRaw(names, capture.ignored, sink);
  if (names.empty()) {
    const auto film = std::ranges::find_if(capture.ignored, [](const auto& name) { return HasVideoExtension(name); });
    throw InputError(folder,
                     capture.ignored.empty() ? "the folder is empty"
                                             : fmt::format("no photo among its {} files ({})", capture.ignored.size(),
                                                           Listing(capture.ignored)),
                     film != capture.ignored.end() ? "for one video give its file: " + (folder / *film).string()
                                                   : "give a folder of JPEG, PNG, TIFF, HEIC or RAW photos");
  }
  if (const auto n = no_photos.size(); n > 0)
    sink.Message(fmt::format("ignored {} file{} that {} no photo{}: {}", n, n == 1 ? "" : "s", n == 1 ? "is" : "are",
                             n == 1 ? "" : "s", Listing(no_photos)));

  std::vector<InputPhoto> photos(names.size());
  std::vector<std::string> reasons(names.size());
  Progress progress(sink, "checking photos", static_cast<long>(names.size()));
  ParallelEach(names.size(), 1, [&](std::size_t i) {
    const fs::path path = folder / names[i];
    try {
      const ImageInfo info = ReadImageInfo(path);
      const auto head = ReadRange(path, 0, 0, 32);
      const bool raw = HasRawExtension(path);                     // to develop it takes seconds: once is enough
      if (!raw && !EndsAsItShould(path, head)) ReadImage8(path);  // throws for half a photograph
      photos[i] = AsPhoto(names[i], info);
      photos[i].needs_conversion = raw || !ColmapReads(head);
    } catch (const InputError& e) {
      reasons[i] = e.what();
    }
    progress.Step();
  });
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (reasons[i].empty())
      capture.photos.push_back(photos[i]);
    else
      capture.unreadable.push_back(Unreadable(names[i], reasons[i]));
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
    staged.photos[i].original = names[i];
    staged.photos[i].name = scene_names[i];
  }
  if (renamed > 1) sink.Message(fmt::format("so are {} more", renamed - 1));
  return renamed > 0;
}

// HEIC and AVIF: a copy without loss is ten to twenty times as large, keeps nothing more, and takes longer to read.
static bool WasCompressed(const std::string& name) {
  constexpr std::array kEndings{".heic", ".heif", ".hif", ".avif"};
  return std::ranges::find(kEndings, Lower(fs::path(name).extension().string())) != kEndings.end();
}

Capture StageForColmap(const Capture& capture, const fs::path& staging, ProgressSink& sink) {
  Capture staged = capture;
  staged.folder = staging;
  if (!NameForScene(staged, sink) &&
      std::ranges::none_of(capture.photos, [](const InputPhoto& p) { return p.needs_conversion; }))
    return capture;
  staged.originals = capture.folder;
  std::vector<std::string> reasons(capture.photos.size());
  Progress progress(sink, "converting photos that COLMAP cannot read", static_cast<long>(capture.photos.size()));
  ParallelEach(staged.photos.size(), 1, [&](std::size_t i) {
    InputPhoto& photo = staged.photos[i];
    const fs::path source = fs::absolute(capture.folder / capture.photos[i].name);
    if (photo.needs_conversion) {
      photo.original = capture.photos[i].name;
      photo.name += WasCompressed(photo.name) ? ".jpg" : ".png";
    }
    const fs::path target = staging / photo.name;
    fs::create_directories(target.parent_path());
    std::error_code ec;
    if (photo.needs_conversion) {
      if (!fs::exists(target, ec) || fs::last_write_time(target, ec) < fs::last_write_time(source, ec)) try {
          WriteImage(target, ReadImage8(source), kJpegQuality);
        } catch (const InputError& e) {
          reasons[i] = e.what();
        }
    } else if (!fs::is_symlink(target, ec) || fs::read_symlink(target, ec) != source) {
      fs::remove(target, ec);
      fs::create_symlink(source, target);
    }
    progress.Step();
  });
  for (std::size_t i = 0; i < reasons.size(); ++i)
    if (!reasons[i].empty()) {
      staged.unreadable.push_back(Unreadable(staged.photos[i].OriginalName(), reasons[i]));
      sink.Message(fmt::format("left out {}: {}", staged.unreadable.back().name, staged.unreadable.back().reason));
      staged.photos[i].name.clear();
    }
  std::erase_if(staged.photos, [](const InputPhoto& photo) { return photo.name.empty(); });
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

void CopyPhotoFacts(const Capture& capture, Scene& scene) {
  std::map<std::string, const InputPhoto*> photo_of;
  for (const InputPhoto& photo : capture.photos) photo_of[photo.name] = &photo;
  for (View& view : scene.views) {
    const auto it = photo_of.find(view.name);
    if (it == photo_of.end()) continue;
    view.time_s = it->second->time_s;
    view.frame_index = it->second->frame_index;
    view.orientation = it->second->orientation;
  }
}

}  // namespace lumi
