#include "proxy/commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <nlohmann/json.hpp>

#include "proxy/delaunay/delaunay_proxy.h"
#include "proxy/describe.h"
#include "proxy/hull/soundness.h"
#include "proxy/make_proxy.h"
#include "proxy/plane/plane_proxy.h"
#include "proxy/proxy_store.h"
#include "scene/files/atomic_file.h"
#include "scene/files/mesh_io.h"
#include "scene/files/scene_folder.h"
#include "scene/program/error.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace {

using Json = nlohmann::ordered_json;

Scene Open(const std::filesystem::path& path, ProgressSink& progress) {
  OpenOptions options;
  options.check_photos = false;  // proxies are made of cameras and points
  Scene scene = OpenScene(path, options, progress);
  RequireMetric(scene, "a proxy");
  return scene;
}

}  // namespace

std::string MakeProxy(const ProxyTarget& target, const std::string& kind, std::map<std::string, std::string> options,
                      std::map<std::string, std::string> inputs, ProgressSink& progress,
                      const std::function<Mesh(const Scene&, Json&)>& make) {
  const auto start = std::chrono::steady_clock::now();
  Scene scene = Open(target.scene, progress);
  Json json{{"name", target.name}, {"kind", kind}, {"faces", 0}, {"vertices", 0}, {"closed", false}, {"seconds", 0.0}};
  Mesh mesh;
  if (!target.output.empty()) {
    if (!target.output.has_extension() || (target.output.extension() != ".ply" && target.output.extension() != ".obj")) {
      throw UsageError("--output " + target.output.string() + " is no mesh file", "end it with .ply or .obj");
    }
    mesh = make(scene, json);
    WriteMesh(target.output, mesh);
    json["file"] = target.output.string();
    json["reused"] = false;
  } else {
    RequireKeepsProxies(scene);
    RequireProxyName(target.name);
    const FolderLock lock(scene.folder);
    Provenance wanted = ProxyProvenance(scene, target.name, kind, std::move(options));
    wanted.inputs.merge(inputs);
    RequireSameKind(scene, wanted, target.name);
    const std::filesystem::path path = ProxyPath(scene.folder, target.name);
    const bool reused = IsUpToDate(scene.folder, wanted);
    if (reused) {
      mesh = ReadMesh(path);
    } else {
      mesh = make(scene, json);
      StoreProxy(scene, target.name, mesh, std::move(wanted), SecondsSince(start));
    }
    if (target.activate || scene.active_proxy.empty()) Activate(scene, target.name);
    json["file"] = path.string();
    json["reused"] = reused;
    json["active"] = scene.active_proxy == target.name;
  }
  json["faces"] = mesh.faces.size();
  json["vertices"] = mesh.vertices.size();
  json["closed"] = IsClosed(mesh);
  json["seconds"] = SecondsSince(start);
  return json.dump();
}

std::string RunPlane(const ProxyTarget& target, ProgressSink& progress) {
  return MakeProxy(target, "plane", {}, {}, progress, [](const Scene& scene, Json& json) {
    PlaneSummary summary;
    Mesh mesh = BuildPlaneProxy(scene, {}, &summary);
    json["depth"] = summary.depth;
    json["points_used"] = summary.points_used;
    json["clamped_rays"] = summary.clamped_rays;
    return mesh;
  });
}

std::string RunDelaunay(const ProxyTarget& target, double merge_px, ProgressSink& progress) {
  DelaunayOptions options;
  options.merge_px = merge_px;
  return MakeProxy(target, "delaunay", OptionValues(options), {}, progress,
                   [&](const Scene& scene, Json& json) {
    DelaunaySummary s;
    Mesh mesh = BuildDelaunayProxy(scene, options, progress, &s);
    json["points_used"] = s.vertices_used;
    json["points_total"] = s.selection.total;
    json["points_refused"] = {{"unusable", s.selection.unusable}, {"inaccurate", s.selection.inaccurate}, {"isolated", s.selection.isolated}};
    json["tetrahedra"] = s.tetrahedra;
    json["lines_of_sight"] = s.rays;
    json["blocked_ray_fraction"] = s.blocked_ray_fraction;
    json["seconds_by_step"] = {{"select", s.select_s}, {"tetrahedra", s.tetrahedra_s}, {"lines_of_sight", s.rays_s}, {"cut", s.cut_s}, {"surface", s.surface_s}};
    return mesh;
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

std::string RunHull(const HullRequest& request, const ProxyTarget& target, ProgressSink& progress) {
  if (const std::string wrong = Validate(request.hull); !wrong.empty()) throw UsageError(wrong);
  const Scene opened = Open(target.scene, progress);
  const std::filesystem::path folder = request.silhouettes.empty() ? opened.folder / "silhouettes" : request.silhouettes;
  const HullOptions& h = request.hull;
  const CleanOptions& c = request.clean;
  std::map<std::string, std::string> options{{"cell_px", fmt::format("{}", h.cell_px)}, {"max_dilation_px", fmt::format("{}", h.max_dilation_px)},
                                             {"dilation_px", h.dilation_px ? fmt::format("{}", *h.dilation_px) : "auto"},
                                             {"keep_all_views", h.keep_all_views ? "yes" : "no"}, {"max_mended", fmt::format("{}", h.max_mended)},
                                             {"clean", fmt::format("{} {} {} {} {}", c.close_px, c.grow_px, c.min_part_px, c.min_radius_px, c.min_hole_px)}};
  Json made;
  Json json = Json::parse(MakeProxy(target, "hull", std::move(options), {{"silhouettes", Fingerprint(folder)}}, progress, [&](const Scene& scene, Json&) {
    std::vector<std::string> without;
    const std::vector<SilhouetteView> views = ReadSilhouettes(scene, folder, c, &without, progress);
    HullSummary s;
    Mesh mesh = BuildVisualHull(views, h, progress, &s, MedianPoint(scene));
    const Soundness sound = CheckSoundness(mesh);
    made = Json{{"coverage_min", s.fit.coverage_min}, {"iou_min", s.fit.iou_min}, {"iou_median", s.fit.iou_median},
                {"deepest_uncovered_px", s.fit.deepest_uncovered_px}, {"dilation_px", s.dilation_px}, {"cell_px", s.cell_px}, {"cell", s.cell},
                {"volume", s.volume}, {"bounded", s.bounded}, {"sound", sound.IsSolid()}, {"soundness", sound.Describe()}, {"parts", sound.parts},
                {"views_used", s.used.size()}, {"views_left_out", Json::array()}, {"views_mended", Json::array()},
                {"seconds_by_step", {{"agreement", s.agreement_s}, {"mending", s.mend_s}, {"contour", s.contour_s}, {"measure", s.measure_s}}}};
    for (const std::string& name : without) made["views_left_out"].push_back({{"name", name}, {"reason", "it has no silhouette"}});
    for (const auto& l : s.left_out) made["views_left_out"].push_back({{"name", l.name}, {"reason", l.reason}});
    for (const auto& m : s.mended) made["views_mended"].push_back({{"name", m.name}, {"share", m.share}});
    return mesh;
  }));
  if (target.output.empty()) {
    // Beside the mesh, for a run that has nothing to do.
    const std::filesystem::path record = ProxyPath(opened.folder, target.name).replace_extension(".json");
    std::error_code error;
    if (!made.empty()) WriteTextAtomically(record, made.dump(2) + "\n");
    else if (std::filesystem::exists(record, error)) made = Json::parse(ReadText(record));
  }
  json.update(made);
  return json.dump();
}

std::string RunSilhouettes(const std::filesystem::path& path, const SilhouetteSource& source, const CleanOptions& clean,
                           const std::filesystem::path& output, ProgressSink& progress) {
  const auto start = std::chrono::steady_clock::now();
  const Scene scene = Open(path, progress);
  std::optional<FolderLock> lock;
  if (output.empty()) {
    RequireKeepsProxies(scene);
    lock.emplace(scene.folder);
  }
  const std::filesystem::path folder = output.empty() ? scene.folder / "silhouettes" : output;
  Json json{{"folder", folder.string()}, {"silhouettes", Json::array()}};
  std::map<SilhouetteKind, std::size_t> kinds;
  for (const FoundSilhouette& f : MakeSilhouettes(scene, source, clean, folder, progress)) {
    ++kinds[f.info.kind];
    json["silhouettes"].push_back({{"name", f.name}, {"kind", Name(f.info.kind)}, {"pixels", f.info.pixels}, {"parts", f.info.parts},
                                   {"holes", f.info.holes}, {"touches_border", f.info.touches_border}});
  }
  json["empty"] = kinds[SilhouetteKind::kEmpty];
  json["full"] = kinds[SilhouetteKind::kFull];
  json["tiny"] = kinds[SilhouetteKind::kTiny];
  json["seconds"] = SecondsSince(start);
  return json.dump();
}

std::string DescribeProxy(const std::string& text) {
  const Json json = Json::parse(text);
  std::string out;
  if (json.contains("tradeoff") || json.contains("faces_before")) return DescribeSimplified(text);
  if (json.contains("candidates")) return DescribeAuto(text);
  if (json.contains("proxies")) return DescribeInfo(text);
  if (json.contains("silhouettes")) {
    out = fmt::format("{} silhouettes in {}, {:.2f} s", json["silhouettes"].size(), json["folder"].get<std::string>(), json["seconds"].get<double>());
    for (const Json& s : json["silhouettes"]) {
      if (s["kind"] != "normal") out += fmt::format("\n{}: {}, {} pixels", s["name"].get<std::string>(), s["kind"].get<std::string>(), s["pixels"].get<std::size_t>());
      else if (s["touches_border"] == true) out += fmt::format("\n{}: touches the photo's border", s["name"].get<std::string>());
    }
    return out;
  }
  out = fmt::format("{}: {} faces, {}, {:.2f} s{}", json["file"].get<std::string>(), json["faces"].get<std::size_t>(),
                    json["closed"].get<bool>() ? "closed" : "open", json["seconds"].get<double>(), json["reused"].get<bool>() ? " (nothing had changed)" : "");
  if (json.contains("repaired")) {
    out += "\n" + json["soundness"].get<std::string>();
    if (json.contains("pairs")) out += fmt::format("\nplaced by {} pairs of points, {:.4g} apart (rms)", json["pairs"]["count"].get<std::size_t>(), json["pairs"]["rms"].get<double>());
    if (json.contains("icp")) {
      const Json& icp = json["icp"];
      out += fmt::format("\naligned with the points: {:.4g} apart (rms, {:.2f} % of the mesh's diagonal) over {:.0f} % of the {} points near it, {} iterations, scale {:.6g}",
                         icp["rms"].get<double>(), 100 * icp["rms_of_diagonal"].get<double>(), 100 * icp["overlap"].get<double>(), icp["points"].get<std::size_t>(),
                         icp["iterations"].get<int>(), json["placement"]["scale"].get<double>());
    }
    out += fmt::format("\nthe views see it in {:.1f} % of their rays", 100 * json["coverage"].get<double>());
  }
  if (json.contains("blocked_ray_fraction")) {
    out += fmt::format("\n{} of {} points, {:.2f} % of {} lines of sight blocked", json["points_used"].get<std::size_t>(), json["points_total"].get<std::size_t>(),
                       100 * json["blocked_ray_fraction"].get<double>(), json["lines_of_sight"].get<std::size_t>());
  }
  if (json.contains("iou_median")) {
    out += fmt::format("\n{}; volume {:.6g}{}\n{} views: covered {:.2f} % at least, deepest uncovered pixel {:.1f} px from the border, after a dilation of {:.2f} px; "
                       "intersection over union {:.4f} median, {:.4f} least",
                       json["soundness"].get<std::string>(), json["volume"].get<double>(), json["bounded"].get<bool>() ? "" : ", cut off: the views leave it open to a side",
                       json["views_used"].get<std::size_t>(), 100 * json["coverage_min"].get<double>(), json["deepest_uncovered_px"].get<double>(),
                       json["dilation_px"].get<double>(), json["iou_median"].get<double>(), json["iou_min"].get<double>());
    if (const Json mended = json.value("views_mended", Json::array()); !mended.empty()) {
      double most = 0;
      for (const Json& m : mended) most = std::max(most, m["share"].get<double>());
      out += fmt::format("\n{} silhouettes mended where they lack what others show, by {:.1f} % at most", mended.size(), 100 * most);
    }
    for (const Json& l : json["views_left_out"]) out += fmt::format("\nleft out {}: {}", l["name"].get<std::string>(), l["reason"].get<std::string>());
  }
  return out;
}

}  // namespace lumi
