#include <fmt/format.h>

#include <chrono>
#include <memory>

#include "proxy/commands.h"
#include "proxy/dense/depth_files.h"
#include "proxy/make_proxy.h"
#include "proxy/proxy_store.h"
#include "proxy/simplify/simplify.h"
#include "scene/files/scene_masks.h"
#include "scene/files/temporary_folder.h"
#include "scene/program/error.h"
#include "scene/program/registers.h"
#include "scene/program/stopwatch.h"
#include "scene/program/version.h"

namespace lumi {
namespace {
namespace fs = std::filesystem;

// For another tool's maps: how many photos may agree with one. More than stereo compares with, since agreement is all
// that is computed.
constexpr std::size_t kMostPartners = 10;

void CheckDense(const DenseRequest& r) {
  if (const std::string wrong = Validate(r.dense); !wrong.empty()) throw UsageError(wrong);
  if (r.depth_only && !r.from_depth.empty()) throw UsageError("--depth-only and --from-depth exclude each other");
  std::error_code error;
  if (!r.from_depth.empty() && !fs::is_directory(r.from_depth / "depth_maps", error))
    throw InputError(r.from_depth, "has no folder depth_maps", "give the folder stereo of a dense workspace");
}

// Where maps are kept: in the scene, so that a run that was killed goes on; for another tool's scene in a temporary
// folder.
std::string MapsFolderName(int leave_out, bool keep_choosing_fold = false) {
  if (leave_out == 0) return "planes";
  return fmt::format("planes-without-{}{}", leave_out, keep_choosing_fold ? "-reported" : "");
}
std::string MapsFolderName(const ProxyTarget& target) {
  if (target.leave_out == kLeaveOutEach) return fmt::format("planes-without-each-{}", target.fold);
  return MapsFolderName(target.leave_out, target.keep_choosing_fold);
}

std::vector<std::vector<std::int32_t>> Partners(const std::vector<std::vector<SourceView>>& sources) {
  std::vector<std::vector<std::int32_t>> partners(sources.size());
  for (std::size_t v = 0; v < sources.size(); ++v) {
    for (const SourceView& s : sources[v]) {
      partners[v].push_back(s.view.value);
      partners[static_cast<std::size_t>(s.view.value)].push_back(static_cast<std::int32_t>(v));
    }
  }
  for (std::vector<std::int32_t>& p : partners) {
    std::ranges::sort(p);
    p.erase(std::unique(p.begin(), p.end()), p.end());
  }
  return partners;
}

FusionInput InputOf(StereoMaps& maps) {
  return {Partners(maps.sources()), [&maps](std::int32_t view) -> FusionMap {
            const auto v = static_cast<std::size_t>(view);
            return {maps.CameraOf(v), maps.Load(v)};
          }};
}

FusionInput InputFrom(const Scene& scene, const fs::path& folder) {
  return {Partners(PickSources(scene, kMostPartners)), [&scene, folder](std::int32_t v) -> FusionMap {
            const View& view = scene.views[static_cast<std::size_t>(v)];
            const Camera& photo = scene.CameraOf(view);
            const StereoCamera camera = MakeStereoCamera(scene, view, photo.width_px, photo.height_px);
            auto map = ReadColmapDepth(folder, view.name, camera);
            if (!map) return {};
            return {Resized(camera, map->width, map->height), std::make_shared<const DepthMap>(std::move(*map))};
          }};
}

Mesh BuildFull(const Scene& scene, const DenseRequest& r, const fs::path& maps_folder, ProgressSink& progress,
               DenseSummary& summary) {
  if (!r.from_depth.empty()) {
    for (const View& view : scene.views)
      if (std::error_code error; fs::exists(r.from_depth / "depth_maps" / (view.name + ".geometric.bin"), error) ||
                                 fs::exists(r.from_depth / "depth_maps" / (view.name + ".photometric.bin"), error))
        ++summary.stereo.photos;
      else
        summary.stereo.without.push_back(view.name);
    if (summary.stereo.photos < 2)
      throw DataError(
          fmt::format("{} has depth maps of {} of the scene's photos", r.from_depth.string(), summary.stereo.photos),
          "maps are named after photos: PHOTO.jpg.geometric.bin");
    return BuildDenseProxy(scene, InputFrom(scene, r.from_depth), r.dense, progress, summary);
  }
  fs::path given;
  if (r.maps_without != 0) given = maps_folder.parent_path() / MapsFolderName(r.maps_without);
  StereoMaps maps(scene, r.dense.stereo, maps_folder, progress, given);
  summary.stereo = maps.summary();
  return BuildDenseProxy(scene, InputOf(maps), r.dense, progress, summary);
}

Mesh MakeDense(const Scene& scene, const DenseRequest& r, const fs::path& maps_folder, ProgressSink& progress,
               DenseSummary& summary) {
  Mesh mesh = BuildFull(scene, r, maps_folder, progress, summary);
  const auto wanted = static_cast<std::size_t>(r.dense.faces);
  if (wanted == 0 || mesh.faces.size() <= wanted) return mesh;
  summary.faces_before = mesh.faces.size();
  SimplifiedMesh simple =
      std::move(Simplify(mesh, {wanted}, SimplifyMethod::kInPixels, progress, MakeProxyViews(scene)).front());
  summary.simplify_s = simple.seconds;
  summary.removed_parts = simple.removed_parts;
  summary.reached = simple.reached;
  if (!simple.reached) progress.Message(FacesLeft(simple.mesh.faces.size(), wanted, SimplifyMethod::kInPixels));
  return std::move(simple.mesh);
}

std::map<std::string, std::string> SeenBy(const Scene& scene) {
  return {{"images", Fingerprint(scene.image_folder)},
          {"masks", Fingerprint(MasksFolder(scene))},
          {"silhouettes", Fingerprint(scene.folder / "silhouettes")}};
}

DenseRequest Seeded(DenseRequest request) {
  request.dense.stereo.seed = static_cast<std::uint32_t>(request.seed);
  return request;
}

}  // namespace

Made<DenseSummary> RunDense(const ProxyTarget& target, const DenseRequest& given, ProgressSink& progress) {
  const DenseRequest request = Seeded(given);
  CheckDense(request);
  const Scene opened = OpenForProxy(target.scene, progress);
  std::map<std::string, std::string> options = OptionValues(request.dense);
  options["from"] = request.from_depth.empty() ? "stereo" : "depth";
  std::map<std::string, std::string> inputs = SeenBy(opened);
  if (request.maps_without != 0) options["maps_without"] = std::to_string(request.maps_without);
  if (!request.from_depth.empty()) inputs["depth"] = Fingerprint(request.from_depth / "depth_maps");
  std::optional<TemporaryFolder> elsewhere;
  fs::path folder = opened.folder / "stereo";
  if (!target.output.empty()) folder = elsewhere.emplace().path();
  std::optional<DenseSummary> figures;
  Made<DenseSummary> made{MakeProxy(target, "dense", std::move(options), std::move(inputs), progress,
                                    [&](const Scene& scene) -> BuiltProxy {
                                      DenseSummary& f = figures.emplace();
                                      Mesh mesh =
                                          MakeDense(scene, request, folder / MapsFolderName(target), progress, f);
                                      // Photos that the user left out are not named as lacking a map.
                                      if (target.leave_out != 0)
                                        for (std::size_t v = 0; const bool keep : KnownPhotos(target, opened)) {
                                          if (!keep) std::erase(f.stereo.without, opened.views[v].name);
                                          ++v;
                                        }
                                      return {std::move(mesh), f};
                                    }),
                          figures};
  if (target.output.empty()) TakeFigures(opened.folder, made);
  return made;
}

// What COLMAP's layout is made of, beside the folder that maps wait in.
static Provenance DepthsWanted(const Scene& scene, const DenseRequest& r) {
  Provenance wanted;
  wanted.stage = "depth-maps";
  wanted.version = kVersion;
  wanted.options = OptionValues(r.dense.stereo);
  wanted.options["max_cost"] = fmt::format("{}", r.dense.fusion.max_cost);
  wanted.inputs = SeenBy(scene);
  wanted.inputs["sparse"] = Fingerprint(scene.folder / "sparse");
  return wanted;
}

static std::string StageOfPart(const ProxyTarget& target, const Part& part) {
  const std::string kind = MapsFolderName(target).substr(std::string("planes").size());  // "-without-8"
  return fmt::format("depth-maps{}-part-{}-of-{}", kind, part.index, part.count);
}

DepthPartSummary RunDensePart(const ProxyTarget& target, const DenseRequest& given, const Part& part,
                              ProgressSink& progress) {
  const DenseRequest request = Seeded(given);
  const Stopwatch watch;
  CheckDense(request);
  if (!target.output.empty() || !request.from_depth.empty() || target.leave_out == kLeaveOutEach)
    throw UsageError(fmt::format("--shard makes depth maps in the scene: it does not go with {}",
                                 !target.output.empty()        ? "--output"
                                 : !request.from_depth.empty() ? "--from-depth"
                                                               : "--leave-out each"));
  const Scene opened = OpenForProxy(target.scene, progress);
  RequireKeepsProxies(opened);
  const FolderLock lock(opened.folder, FolderLock::kWithOthers);
  const Scene scene = KnownTo(target, opened);
  DepthPartSummary summary{opened.folder / "stereo" / MapsFolderName(target), part, {}, 0};
  {
    const StereoMaps maps(scene, request.dense.stereo, summary.folder, part, progress);
    summary.stereo = maps.summary();
  }
  summary.seconds = watch.Seconds();
  Provenance made = DepthsWanted(opened, request);
  made.stage = StageOfPart(target, part);
  made.options["part"] = fmt::format("{}/{}", part.index, part.count);
  made.options["registers_bits"] = std::to_string(8 * WidestRegister());
  made.options["finished"] = summary.stereo.unfinished == 0 ? "yes" : "no";
  made.seconds = summary.seconds;
  WriteProvenance(opened.folder, made);
  return summary;
}

DepthsSummary RunDenseDepths(const ProxyTarget& target, const DenseRequest& given, ProgressSink& progress) {
  const DenseRequest request = Seeded(given);
  const auto start = std::chrono::steady_clock::now();
  CheckDense(request);
  if (target.leave_out != 0) throw UsageError("--depth-only and --leave-out exclude each other");
  const Scene opened = OpenForProxy(target.scene, progress);
  std::optional<FolderLock> lock;
  std::optional<TemporaryFolder> elsewhere;
  std::optional<StageRecord> record;
  DepthsSummary summary;
  fs::path planes = opened.folder / "stereo";
  if (target.output.empty()) {
    RequireKeepsProxies(opened);
    lock.emplace(opened.folder);
    summary.folder = planes;
    record.emplace(opened.folder, DepthsWanted(opened, request));
    if (auto before = record->Before<DepthsSummary>()) {
      before->reused = true;
      before->seconds = SecondsSince(start);
      return *before;
    }
  } else {
    RequireOurFolder(target.output, "fusion.cfg");
    summary.folder = target.output;
    planes = elsewhere.emplace().path();
  }
  const Scene& scene = opened;
  StereoMaps maps(scene, request.dense.stereo, planes / MapsFolderName(target), progress);
  summary.stereo = maps.summary();
  Progress steps(progress, "writing depth maps", static_cast<long>(scene.views.size()));
  std::vector<std::string> photos;
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    if (const auto map = maps.Load(v)) {
      WriteColmapDepth(summary.folder, scene.views[v].name, maps.CameraOf(v), *map,
                       static_cast<float>(request.dense.fusion.max_cost));
      photos.push_back(scene.views[v].name);
    }
    steps.Step();
  }
  WriteColmapLists(summary.folder, photos);
  summary.seconds = SecondsSince(start);
  if (record)
    record->Keep(summary, summary.seconds,
                 {"stereo/depth_maps", "stereo/normal_maps", "stereo/fusion.cfg", "stereo/patch-match.cfg"});
  return summary;
}

}  // namespace lumi
