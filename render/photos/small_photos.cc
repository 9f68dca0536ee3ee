#include "render/photos/small_photos.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>

#include "render/photos/photo_cache.h"
#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/program/error.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;

Eigen::Vector2i CopySize(const Scene& scene, std::size_t view, int halvings) {
  const Camera& camera = scene.CameraOf(scene.views[view]);
  return HalvedSize({camera.width_px, camera.height_px}, halvings);
}

// What the copies were made from, a line a photo; the pixels follow, RGB, row by row, photo after photo.
std::string Header(const Scene& scene, int halvings) {
  std::string text =
      fmt::format("lumigraph small photos 1, {} of them, halved {} times\n", scene.views.size(), halvings);
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    const fs::path file = scene.ImagePath(scene.views[v]);
    std::error_code ec;
    const auto bytes = fs::file_size(file, ec);
    const auto time = fs::last_write_time(file, ec).time_since_epoch().count();
    const Eigen::Vector2i size = CopySize(scene, v, halvings);
    text += fmt::format("{} {} {}x{} {}", ec ? 0 : bytes, ec ? 0 : time, size.x(), size.y(), scene.views[v].name);
    if (const auto& c = scene.views[v].correction)
      text += fmt::format(" corrected {} {} {} {} {}", c->channel[0], c->channel[1], c->channel[2], c->falloff.a,
                          c->falloff.b);
    text += '\n';
  }
  return text + "\n";
}

fs::path FileOf(const Scene& scene, int halvings) { return scene.folder / "small-photos" / std::to_string(halvings); }

// Empty images where there is no such file, or one of other photos.
std::vector<Image8> ReadKept(const Scene& scene, int halvings, const std::string& header) {
  std::vector<Image8> kept;
  std::ifstream in(FileOf(scene, halvings), std::ios::binary);
  std::string found(header.size(), '\0');
  if (!in.read(found.data(), static_cast<std::streamsize>(found.size())) || found != header) return kept;
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    const Eigen::Vector2i size = CopySize(scene, v, halvings);
    Image8 image(size.x(), size.y(), 3);
    if (!in.read(reinterpret_cast<char*>(image.data.data()), static_cast<std::streamsize>(image.data.size())))
      return {};
    kept.push_back(std::move(image));
  }
  return kept;
}

std::vector<Image8> MakeSmall(const Scene& scene, int halvings, ProgressSink& sink) {
  std::vector<Image8> made(scene.views.size());
  Progress progress(sink, "making small copies of the photos", static_cast<long>(made.size()));
  const std::size_t at_once = PhotoCache::ReadableAtOnce(scene);
  for (std::size_t from = 0; from < made.size(); from += at_once)
    ParallelFor(std::min(at_once, made.size() - from), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t v = from + begin; v < from + end; ++v) {
        const Photo photo = LoadPhoto(scene, {static_cast<std::int32_t>(v)}, {});
        const Image8& copy = photo.levels[std::min(static_cast<std::size_t>(halvings), photo.levels.size() - 1)];
        const Eigen::Vector2i size = CopySize(scene, v, halvings);
        if (copy.width != size.x() || copy.height != size.y())
          throw InputError(scene.ImagePath(scene.views[v]), "is not of its camera's size");
        made[v] = copy;
        progress.Step();
      }
    });
  return made;
}

}  // namespace

bool KeepsSmallPhotos(const Scene& scene) {
  std::error_code ec;
  return fs::exists(scene.folder / "lumigraph.json", ec);
}

bool CallsForSmallPhotos(const Scene& scene) {
  constexpr std::size_t kManyPhotos = 500;  // fewer are read soon enough
  return scene.views.size() >= kManyPhotos && KeepsSmallPhotos(scene);
}

std::vector<Photo> ReadSmallPhotos(const Scene& scene, int halvings, ProgressSink& sink) {
  const std::string header = Header(scene, halvings);
  std::vector<Image8> small = ReadKept(scene, halvings, header);
  if (small.empty()) {
    small = MakeSmall(scene, halvings, sink);
    if (KeepsSmallPhotos(scene)) try {
        const fs::path file = FileOf(scene, halvings);
        fs::create_directories(file.parent_path());
        WriteFileAtomically(file, [&](const fs::path& partial) {
          std::ofstream out(partial, std::ios::binary);
          out << header;
          for (const Image8& image : small)
            out.write(reinterpret_cast<const char*>(image.data.data()),
                      static_cast<std::streamsize>(image.data.size()));
          if (!out.flush()) throw MachineError("cannot be written", {}, partial);
        });
      } catch (const std::exception& e) {  // a disk that is full, a folder of somebody else's: made again next time
        sink.Message(fmt::format("small copies of the photos are not kept: {}", e.what()));
      }
  }
  std::vector<Photo> photos(small.size());
  ParallelFor(small.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      photos[v].levels = BuildPyramid(std::move(small[v]));
      photos[v].level0_shift = halvings;
    }
  });
  return photos;
}

}  // namespace lumi
