#include "export/web_export.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "export/held_photos.h"
#include "export/own_output.h"
#include "export/quantised_mesh.h"
#include "export/reduce_photos.h"
#include "export/web_manifest.h"
#include "export/web_package.h"
#include "render/lumigraph/lumigraph.h"
#include "render/path/camera_path.h"
#include "scene/files/atomic_file.h"
#include "scene/files/mesh_io.h"
#include "scene/files/scene_folder.h"
#include "scene/program/error.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

constexpr double kPathSeconds = 12, kPathFps = 30;
// The largest share of the page's megabytes that the proxy may take.
constexpr double kMostOfProxy = 0.5;
constexpr const char* kDataMarker = ".lumi-web-data";  // in a scene folder that --as-scene made, even if unfinished
constexpr double kTradeoffMb[] = {4, 8, 16, 32, 64};

bool IsOneFile(const fs::path& output) {
  const std::string ending = output.extension().string();
  return ending == ".html" || ending == ".htm";
}

void RequireConsistent(const WebOptions& o) {
  if (o.output.empty() && !o.tradeoff) throw UsageError("-o FILE.html or -o DIR is missing");
  if (!o.output.empty() && o.tradeoff) throw UsageError("--tradeoff writes no page: leave -o out");
  if (!(o.max_mb > 0)) throw UsageError("--max-mb must be > 0");
  if (!o.tradeoff) RequireOurOutput(o.output, IsOneFile(o.output));
  if (!o.as_scene.empty()) RequireOurExport(o.as_scene, kDataMarker);
}

// The page's data as a scene of its own.
void WriteAsScene(const ReducedPhotos& reduced, const QuantisedMesh& mesh, const std::string& proxy,
                  const fs::path& folder) {
  Scene scene = reduced.scene;
  scene.image_folder = folder / "images";
  scene.folder = folder;
  WriteTextAtomically(folder / kDataMarker, "made by lumi-export web --as-scene\n");
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    View& view = scene.views[i];
    // The ending is added, not replaced: two photos' names may differ only by their endings.
    if (fs::path(view.name).extension() != ".jpg") view.name += ".jpg";
    WriteBytesAtomically(scene.image_folder / view.name, reduced.photos[i].jpeg.data(), reduced.photos[i].jpeg.size());
  }
  const Similarity3 world = scene.normalized_from_world.Inverse();
  Mesh in_world = mesh.mesh;
  for (Eigen::Vector3d& v : in_world.vertices) v = world * v;
  WriteMesh(ProxyPath(folder, proxy), in_world);
  scene.active_proxy = proxy;
  std::ranges::sort(scene.views, {}, &View::name);
  WriteScene(scene, folder);
}

}  // namespace

void ListKeys(JsonKeys& j, PhotoReduction& r) {
  j("every", r.every, "scale", r.scale, "quality", r.quality, "own_files", r.own, "mb", r.mb, "psnr_seen_db",
    r.psnr_db);
}

void ListKeys(JsonKeys& j, WebSummary& s) {
  j("output", s.output, "proxy", s.proxy, "photos", s.photos, "photos_of_scene", s.photos_of_scene, "faces", s.faces,
    "mb", s.mb, "chosen", s.chosen, "tried", s.tried, "seconds", s.seconds);
}

std::string DescribeQuality(const PhotoReduction& r, int photos) {
  if (r.own == photos) return "as they are";
  const std::string coded = fmt::format("JPEG quality {}", std::min(r.quality, kBestCoded));
  return r.own == 0 ? coded : fmt::format("{} of them as they are, else {}", r.own, coded);
}

std::string Describe(const WebSummary& s) {
  std::string text;
  if (!s.output.empty())
    text = fmt::format("{}: {:.1f} MB, {} of {} photos at {:.0f} % of their width, {}, {} faces\n", s.output, s.mb,
                       s.photos, s.photos_of_scene, 100 * s.chosen.scale, DescribeQuality(s.chosen, s.photos), s.faces);
  text += "  MB      held out (seen pixels)  photos        width  quality\n";
  for (const PhotoReduction& r : s.tried)
    text += fmt::format("{:6.1f}  {:12.2f} dB         {:12}  {:5.0f} %  {:>5}\n", r.mb, r.psnr_db,
                        r.every == 1 ? "all" : fmt::format("one of {}", r.every), 100 * r.scale,
                        r.own > 0 ? "as is" : fmt::format("{}", std::min(r.quality, kBestCoded)));
  return text;
}

WebSummary ExportWeb(const WebOptions& o, ProgressSink& sink) {
  RequireConsistent(o);
  const Stopwatch watch;
  LumigraphOptions open;
  open.scene = o.scene;
  open.effects = o.effects;
  Lumigraph lumigraph(open, sink);
  RequireMetric(lumigraph.scene(), "a web page");
  lumigraph.MakePictures(o.proxy, false);
  if (!lumigraph.one_mesh())
    throw UsageError("a web page needs one proxy for all views",
                     "make one with lumi-proxy auto, and leave --proxy out");
  const double most_mb = o.tradeoff ? kTradeoffMb[std::size(kTradeoffMb) - 1] : o.max_mb;
  // In memory are the photos, and those that a reduction has made of them.
  lumigraph.ReadPhotos(sink, HalvingsToHold(lumigraph.scene(),
                                            MostPixelsWithin(lumigraph.scene().views.size(), 1e6 * most_mb), 2, sink));
  const CameraPath path = PathThroughPhotos(lumigraph.scene(), kPathSeconds, kPathFps);
  const Eigen::Vector2i film = FilmSize(lumigraph.scene());
  lumigraph.ChooseMeasures(SamplePath(path, film.x(), film.y()), {});

  Mesh normalized = lumigraph.mesh();
  for (Eigen::Vector3d& v : normalized.vertices) v = lumigraph.scene().normalized_from_world * v;
  const QuantisedMesh mesh = Quantise(normalized, MakeSources(lumigraph.scene()).views);

  WebSummary summary;
  summary.photos_of_scene = static_cast<int>(lumigraph.scene().views.size());
  summary.proxy = lumigraph.proxy_name();
  summary.faces = static_cast<int>(mesh.mesh.faces.size());
  const bool one_file = o.tradeoff || IsOneFile(o.output);
  const double bytes_a_byte = one_file ? kBytesInOneFile : 1;
  // Bytes of everything but the photos: proxy, shaders and page, and about a kilobyte of manifest for each photo.
  const double rest = static_cast<double>(mesh.bytes.size()) * bytes_a_byte + 2e5 + 1e3 * summary.photos_of_scene;
  if (o.tradeoff) {
    for (const double mb : kTradeoffMb) {
      if (mb * 1e6 <= rest) continue;
      std::vector<PhotoReduction> tried;
      try {
        PhotoReduction best = ReduceFor(lumigraph, mb * 1e6 - rest, o.width_px, bytes_a_byte, tried, sink).reduction;
        best.mb += rest / 1e6;
        summary.tried.push_back(best);
      } catch (const DataError&) {
        continue;
      }
    }
    summary.seconds = watch.Seconds();
    return summary;
  }
  const double max_bytes = o.max_mb * 1e6;
  const double proxy_bytes = static_cast<double>(mesh.bytes.size()) * bytes_a_byte;
  if (proxy_bytes > kMostOfProxy * max_bytes)
    throw DataError(
        fmt::format("the proxy {} has {} faces, which take {:.1f} of the {:.1f} MB", summary.proxy, summary.faces,
                    proxy_bytes / 1e6, o.max_mb),
        fmt::format("simplify it (lumi-proxy simplify SCENE --faces 20000{} --activate), or give more with --max-mb",
                    summary.proxy.starts_with("hull") ? "" : " --in-pixels"));
  if (rest >= max_bytes)
    throw DataError(fmt::format("a page without photos takes {:.1f} MB of the {:.1f}", rest / 1e6, o.max_mb),
                    "give more with --max-mb");
  // A page that streams also has each photo at a quarter of its width and height: about a tenth more bytes.
  const double for_photos = (max_bytes - rest) / (one_file ? 1 : 1.12);
  const ReducedPhotos reduced = ReduceFor(lumigraph, for_photos, o.width_px, bytes_a_byte, summary.tried, sink);
  for (PhotoReduction& r : summary.tried) r.mb += rest / 1e6;
  const WebPage page = MakeWebPage(lumigraph, reduced, mesh, path, {.previews = !one_file, .memory_mb = o.memory_mb});
  const double bytes = one_file ? WriteOneFile(page, o.output) : WriteWebFolder(page, o.output);
  if (bytes > max_bytes)
    sink.Message(
        fmt::format("{} has {:.1f} MB, more than the {:.1f} asked for: what it holds beside the photos takes "
                    "more than expected",
                    o.output.string(), bytes / 1e6, o.max_mb));
  if (!o.as_scene.empty()) WriteAsScene(reduced, mesh, summary.proxy, o.as_scene);
  summary.output = o.output.string();
  summary.chosen = reduced.reduction;
  summary.photos = static_cast<int>(reduced.photos.size());
  summary.mb = bytes / 1e6;
  summary.chosen.mb = summary.mb;
  summary.seconds = watch.Seconds();
  return summary;
}

}  // namespace lumi
