#include "proxy/commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <functional>

#include "proxy/delaunay/delaunay_proxy.h"
#include "proxy/hull/soundness.h"
#include "proxy/leave_out.h"
#include "proxy/make_proxy.h"
#include "proxy/plane/plane_proxy.h"
#include "proxy/proxy_store.h"
#include "scene/files/atomic_file.h"
#include "scene/files/evaluation_proxy.h"
#include "scene/files/mesh_io.h"
#include "scene/files/scene_folder.h"
#include "scene/geometry/median.h"
#include "scene/program/error.h"
#include "scene/program/stopwatch.h"
#include "scene/program/version.h"

namespace lumi {

Scene OpenForProxy(const std::filesystem::path& path, ProgressSink& progress) {
  OpenOptions options;
  options.check_photos = false;  // proxies are made of cameras and points
  Scene scene = OpenScene(path, options, progress);
  RequireMetric(scene, "a proxy");
  return scene;
}

std::string StoredName(const ProxyTarget& target) {
  if (target.leave_out == kLeaveOutEach) return ProxyWithoutEach(target.name, target.fold);
  if (target.leave_out == 0 || target.keep_choosing_fold) return target.name;
  return ProxyWithout(target.name, target.leave_out);
}

std::vector<bool> KnownPhotos(const ProxyTarget& target, const Scene& scene) {
  if (target.leave_out == kLeaveOutEach) return PhotosWithoutEach(scene, target.fold);
  if (target.leave_out < 2) throw UsageError("--leave-out must be at least 2");
  return PhotosWithoutFolds(scene, target.leave_out, !target.keep_choosing_fold);
}

Scene KnownTo(const ProxyTarget& target, Scene scene) {
  if (target.leave_out == 0 && !target.keep_choosing_fold) return scene;
  const std::vector<bool> keep = KnownPhotos(target, scene);
  if (std::ranges::count(keep, true) < 2)
    throw DataError(
        target.leave_out == kLeaveOutEach
            ? fmt::format("--leave-out each leaves fewer than two of {} photos", keep.size())
            : fmt::format("--leave-out {} leaves fewer than two of {} photos", target.leave_out, keep.size()),
        target.leave_out == kLeaveOutEach ? "three photos are the least" : "leave out fewer: a larger N");
  return WithPhotos(scene, keep);
}

static std::string LeftOut(const ProxyTarget& target) {
  if (target.leave_out == kLeaveOutEach) return fmt::format("each {} of {}", target.fold, kProxiesForEach);
  return fmt::format("{}{}", target.leave_out, target.keep_choosing_fold ? " reported" : "");
}

ProxySummary MakeProxy(const ProxyTarget& target, const std::string& kind, std::map<std::string, std::string> options,
                       std::map<std::string, std::string> inputs, ProgressSink& progress,
                       const std::function<BuiltProxy(const Scene&)>& make) {
  const auto start = std::chrono::steady_clock::now();
  Scene scene = OpenForProxy(target.scene, progress);
  ProxySummary made;
  const std::string name = made.name = StoredName(target);
  made.kind = kind;
  if (target.leave_out != 0) options["leave_out"] = LeftOut(target);
  Mesh mesh;
  if (!target.output.empty()) {
    if (!target.output.has_extension() || (target.output.extension() != ".ply" && target.output.extension() != ".obj"))
      throw UsageError("--output " + target.output.string() + " is no mesh file", "end it with .ply or .obj");
    RemoveStaleTemporariesOf(target.output);
    mesh = make(KnownTo(target, std::move(scene))).mesh;
    WriteMesh(target.output, mesh);
    made.file = target.output;
  } else {
    RequireKeepsProxies(scene);
    RequireProxyName(target.name);
    if (IsForEvaluation(target.name))
      throw UsageError("\"" + target.name + "\" is no name for a proxy", "--leave-out N makes NAME-without-N");
    const FolderLock lock(scene.folder);
    Provenance wanted = ProxyProvenance(scene, name, kind, std::move(options));
    wanted.inputs.merge(inputs);
    RequireSameKind(scene, wanted, name);
    made.file = ProxyPath(scene.folder, name);
    made.reused = IsUpToDate(scene.folder, wanted);
    if (made.reused) {
      mesh = ReadMesh(made.file);
    } else {
      BuiltProxy built = make(KnownTo(target, scene));
      wanted.seconds = SecondsSince(start);
      StoreProxy(scene, name, built.mesh, built.figures, std::move(wanted));
      mesh = std::move(built.mesh);
    }
    if (target.activate || (scene.active_proxy.empty() && target.leave_out == 0)) Activate(scene, name);
    made.active = scene.active_proxy == name;
  }
  made.faces = mesh.faces.size();
  made.vertices = mesh.vertices.size();
  made.closed = IsClosed(mesh);
  made.seconds = SecondsSince(start);
  return made;
}

Made<PlaneSummary> RunPlane(const ProxyTarget& target, ProgressSink& progress) {
  return MakeAndKeep<PlaneSummary>(target, "plane", {}, {}, progress, [](const Scene& scene, PlaneSummary& figures) {
    return BuildPlaneProxy(scene, {}, &figures);
  });
}

Made<DelaunaySummary> RunDelaunay(const ProxyTarget& target, double merge_px, ProgressSink& progress) {
  DelaunayOptions options;
  options.merge_px = merge_px;
  return MakeAndKeep<DelaunaySummary>(target, "delaunay", OptionValues(options), {}, progress,
                                      [&](const Scene& scene, DelaunaySummary& figures) {
                                        return BuildDelaunayProxy(scene, options, progress, &figures);
                                      });
}

std::optional<Eigen::Vector3d> MedianPoint(const Scene& scene) {
  if (scene.points.empty()) return std::nullopt;
  Eigen::Vector3d median;
  for (int a = 0; a < 3; ++a) {
    std::vector<double> values;
    for (const Point& p : scene.points) values.push_back(p.x_in_world[a]);
    median[a] = Quantile(std::move(values), 0.5);
  }
  return median;
}

static std::string CleanAsText(const CleanOptions& c) {
  return fmt::format("{} {} {} {} {}", c.close_px, c.grow_px, c.min_part_px, c.min_radius_px, c.min_hole_px);
}

Made<HullFigures> RunHull(const HullRequest& request, const ProxyTarget& target, ProgressSink& progress) {
  if (const std::string wrong = Validate(request.hull); !wrong.empty()) throw UsageError(wrong);
  const Scene opened = OpenForProxy(target.scene, progress);
  const std::filesystem::path folder =
      request.silhouettes.empty() ? opened.folder / "silhouettes" : request.silhouettes;
  const HullOptions& h = request.hull;
  const CleanOptions& c = request.clean;
  std::map<std::string, std::string> options{
      {"cell_px", fmt::format("{}", h.cell_px)},
      {"max_dilation_px", fmt::format("{}", h.max_dilation_px)},
      {"dilation_px", h.dilation_px ? fmt::format("{}", *h.dilation_px) : "auto"},
      {"keep_all_views", h.keep_all_views ? "yes" : "no"},
      {"max_mended", fmt::format("{}", h.max_mended)},
      {"max_left_out", fmt::format("{}", h.max_left_out)},
      {"prefer", h.prefer == HullPreference::kTight ? "tight" : "cover"},
      {"clean", CleanAsText(c)}};
  // A folder within the scene stays where it is when the scene is moved.
  if (!request.silhouettes.empty()) {
    const std::filesystem::path within =
        std::filesystem::absolute(folder).lexically_relative(std::filesystem::absolute(opened.folder));
    options["silhouettes"] =
        (within.empty() || *within.begin() == ".." ? std::filesystem::absolute(folder) : within).string();
  }
  std::optional<HullFigures> figures;
  Made<HullFigures> made{MakeProxy(target, "hull", std::move(options), {{"silhouettes", Fingerprint(folder)}}, progress,
                                   [&](const Scene& scene) -> BuiltProxy {
                                     HullFigures& f = figures.emplace();
                                     if (MayBeDistorted(scene, folder))
                                       progress.Message(fmt::format(
                                           "the scene's photos were undistorted: silhouettes in {} are taken to be of "
                                           "these; of the photos as they were taken lumi-proxy silhouettes --masks {} "
                                           "--undistort reads them",
                                           folder.string(), folder.string()));
                                     std::vector<std::string> without;
                                     const std::vector<SilhouetteView> views =
                                         ReadSilhouettes(scene, folder, c, &without, progress);
                                     Mesh mesh = BuildVisualHull(views, h, progress, &f.hull, MedianPoint(scene));
                                     const Soundness sound = CheckSoundness(mesh);
                                     f.sound = sound.IsSolid();
                                     f.soundness = sound.Describe();
                                     f.parts = sound.parts;
                                     f.views_used = f.hull.used.size();
                                     std::vector<HullSummary::LeftOut> left_out;
                                     for (const std::string& name : without)
                                       left_out.push_back({name, "it has no silhouette"});
                                     f.hull.left_out.insert(f.hull.left_out.begin(), left_out.begin(), left_out.end());
                                     return {std::move(mesh), f};
                                   }),
                         figures};
  if (target.output.empty()) TakeFigures(opened.folder, made);
  return made;
}

static Provenance SilhouettesWanted(const Scene& scene, const SilhouetteSource& source, const CleanOptions& c) {
  Provenance wanted;
  wanted.stage = "silhouettes";
  wanted.version = kVersion;
  std::string numbers;
  if (source.colour)
    numbers += fmt::format("colour {} {} {}", source.colour->x(), source.colour->y(), source.colour->z());
  if (source.box_px)
    numbers += fmt::format("box {} {} {} {}", (*source.box_px)[0], (*source.box_px)[1], (*source.box_px)[2],
                           (*source.box_px)[3]);
  wanted.options = {{"rule", source.rule},
                    {"given", numbers},
                    {"border_colour", source.border_colour ? "yes" : "no"},
                    {"alpha", source.alpha ? "yes" : "no"},
                    {"threshold", fmt::format("{}", source.threshold)},
                    {"undistort", source.undistort ? "yes" : "no"},
                    {"clean", CleanAsText(c)}};
  wanted.inputs = {{"images", Fingerprint(scene.image_folder)}, {"sparse", Fingerprint(scene.folder / "sparse")}};
  if (!source.background.empty()) wanted.inputs["background"] = Fingerprint(source.background);
  if (!source.masks.empty()) wanted.inputs["masks"] = Fingerprint(source.masks);
  return wanted;
}

SilhouettesSummary RunSilhouettes(const std::filesystem::path& path, const SilhouetteSource& source,
                                  const CleanOptions& clean, const std::filesystem::path& output,
                                  ProgressSink& progress) {
  const auto start = std::chrono::steady_clock::now();
  const Scene scene = OpenForProxy(path, progress);
  std::optional<FolderLock> lock;
  std::optional<StageRecord> record;
  if (output.empty()) {
    RequireKeepsProxies(scene);
    record.emplace(scene.folder, SilhouettesWanted(scene, source, clean));
    if (auto before = record->Before<SilhouettesSummary>()) {
      before->reused = true;
      before->seconds = SecondsSince(start);
      return *before;
    }
    lock.emplace(scene.folder);
  } else {
    RemoveStaleTemporaries(output);
  }
  for (const std::filesystem::path& given : {source.masks, source.background})
    if (!source.undistort && !given.empty() && MayBeDistorted(scene, given))
      progress.Message(
          fmt::format("the scene's photos were undistorted: what is in {} is taken to be of these; of the "
                      "photos as they were taken it needs --undistort",
                      given.string()));
  SilhouettesSummary s;
  s.folder = output.empty() ? scene.folder / "silhouettes" : output;
  s.silhouettes = MakeSilhouettes(scene, source, clean, s.folder, progress);
  for (const FoundSilhouette& f : s.silhouettes) {
    s.empty += f.info.kind == SilhouetteKind::kEmpty;
    s.full += f.info.kind == SilhouetteKind::kFull;
    s.tiny += f.info.kind == SilhouetteKind::kTiny;
  }
  s.seconds = SecondsSince(start);
  if (record) record->Keep(s, s.seconds, {"silhouettes"});
  return s;
}

}  // namespace lumi
