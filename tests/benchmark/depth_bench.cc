// Depth against the truth of a simulated capture, per photo's own pixels: of dense proxies' depth maps, and of meshes
// as the photos' cameras see them.
//
//   depth_bench CAPTURE [MESH ...]        CAPTURE/stereo/depth_maps (lumi-proxy dense --depth-only), proxies by name
//
// A row each: pixels with a depth, of those with a true one; of these within 1 % and 0.2 %; and of all true pixels.
#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <optional>
#include <string>

#include "proxy/dense/depth_files.h"
#include "proxy/mesh_query.h"
#include "scene/files/image_io.h"
#include "scene/files/scene_folder.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;

struct Counts {
  std::size_t truth = 0, found = 0, percent = 0, fifth = 0;  // pixels; within 1 %, within 0.2 %
  void Add(double depth, double true_depth) {
    ++truth;
    if (!(depth > 0)) return;
    ++found;
    const double off = std::abs(depth / true_depth - 1);
    percent += off <= 0.01;
    fifth += off <= 0.002;
  }
};

void Print(const std::string& capture, const std::string& what, const Counts& c) {
  const auto share = [](std::size_t part, std::size_t whole) {
    return 100.0 * static_cast<double>(part) / static_cast<double>(std::max<std::size_t>(1, whole));
  };
  fmt::print("| {} | {} | {:.1f} | {:.1f} | {:.1f} | {:.1f} |\n", capture, what, share(c.found, c.truth),
             share(c.percent, c.found), share(c.fifth, c.found), share(c.percent, c.truth));
}

ImageF TrueDepth(const fs::path& capture, const View& view) {
  return ReadImageF(capture / "truth" / "depth" / fs::path(view.name).replace_extension(".exr"));
}

// A map's pixel stands for the true depth at its centre.
Counts OfMaps(const Scene& scene, const fs::path& capture) {
  Counts counts;
  for (const View& view : scene.views) {
    const Camera& photo = scene.CameraOf(view);
    const auto map =
        ReadColmapDepth(capture / "stereo", view.name, MakeStereoCamera(scene, view, photo.width_px, photo.height_px));
    const ImageF truth = TrueDepth(capture, view);
    const int width = map ? map->width : truth.width, height = map ? map->height : truth.height;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const float there = truth.At(static_cast<int>((x + 0.5) * truth.width / width),
                                     static_cast<int>((y + 0.5) * truth.height / height), 0);
        if (there > 0) counts.Add(map && map->w[map->At(x, y)] > 0 ? 1 / map->w[map->At(x, y)] : 0, there);
      }
    }
  }
  return counts;
}

// Every fourth pixel each way.
Counts OfMesh(const Scene& scene, const fs::path& capture, const Mesh& mesh) {
  const MeshQuery query(mesh);
  std::vector<Counts> of_view(scene.views.size());
  ParallelEach(scene.views.size(), 1, [&](std::size_t v) {
    const View& view = scene.views[v];
    const ImageF truth = TrueDepth(capture, view);
    const StereoCamera camera = MakeStereoCamera(scene, view, truth.width, truth.height);
    const Eigen::Vector3d eye = view.CentreInWorld();
    for (int y = 2; y < truth.height; y += 4) {
      for (int x = 2; x < truth.width; x += 4) {
        if (!(truth.At(x, y, 0) > 0)) continue;
        const auto hit = query.FirstHit(eye, camera.InWorld(x + 0.5, y + 0.5, 1) - eye);
        of_view[v].Add(hit ? hit->distance : 0, truth.At(x, y, 0));
      }
    }
  });
  Counts counts;
  for (const Counts& c : of_view) {
    counts.truth += c.truth;
    counts.found += c.found;
    counts.percent += c.percent;
    counts.fifth += c.fifth;
  }
  return counts;
}

int Main(const fs::path& capture, const std::vector<std::string>& meshes) {
  const Scene scene = OpenScene(capture, {}, SilentProgress());
  const std::string name = fs::weakly_canonical(capture).filename().string();
  Print(name, "depth maps", OfMaps(scene, capture));
  for (const std::string& mesh : meshes) Print(name, mesh, OfMesh(scene, capture, LoadProxy(scene, mesh)));
  return 0;
}

}  // namespace
}  // namespace lumi

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "depth_bench CAPTURE [MESH ...]\n");
    return 2;
  }
  try {
    return lumi::Main(argv[1], {argv + 2, argv + argc});
  } catch (const lumi::Error& e) {
    fmt::print(stderr, "{}\n", e.what());
    return static_cast<int>(e.code());
  }
}
