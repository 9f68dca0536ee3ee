#include "export/web_manifest.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "render/gl/blend_shader.h"
#include "render/gl/shader_parts.h"
#include "render/picture/source_color.h"
#include "render/radiance/correlation.h"
#include "render/radiance/measures/evaluate.h"
#include "render/world/visibility_maps.h"
#include "scene/files/image_io.h"
#include "scene/files/scene_folder.h"
#include "scene/geometry/median.h"
#include "scene/program/version.h"

namespace lumi {
namespace {

using nlohmann::json;

constexpr int kWebVersion = 1;
constexpr int kCellPx = 32;
constexpr int kPreviewHalvings = 2, kPreviewQuality = 75;
constexpr int kPathKeys = 48;
// The camera does not come nearer to its centre of rotation than this part of the typical depth.
constexpr double kNearest = 0.02;

json Numbers(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
json Rows(const Eigen::Matrix3d& m) {
  json rows = json::array();
  for (int i = 0; i < 9; ++i) rows.push_back(m(i / 3, i % 3));
  return rows;
}

// Pixels from directions, third row unit: w is a depth.
Eigen::Matrix3d Directions(const RenderView& view) {
  const Eigen::Matrix3d m = view.P.leftCols<3>();
  return m / m.row(2).norm();
}

// Clockwise quarter turns that bring a photo of this EXIF orientation upright; mirroring is ignored.
int QuarterTurns(int orientation) {
  switch (orientation) {
    case 3:
    case 4: return 2;
    case 5:
    case 6: return 1;
    case 7:
    case 8: return 3;
    default: return 0;
  }
}

json Shaders() {
  return {{"version", shader::Version(shader::ShaderLanguage::kEs300)},
          {"constants", shader::Constants()},
          {"cameras", shader::kCameras},
          {"measures", shader::Measures()},
          {"rays", shader::Rays()},
          {"photos", shader::Photos()},
          {"blending", shader::Blending()},
          {"row_texels", shader::kEsRowTexels}};
}

// Each measure's fields one after another, and where each begins.
struct Fields {
  std::vector<float> values;
  std::array<Eigen::Vector3i, MeasureList::kCount> place;
};
Fields FieldsOf(const Sources& sources) {
  Fields fields;
  for (std::size_t i = 0; i < sources.fields->size(); ++i) {
    const PhotoField& field = (*sources.fields)[i];
    fields.place[i] = {static_cast<int>(fields.values.size()), field.value.empty() ? 0 : field.columns, field.rows};
    fields.values.insert(fields.values.end(), field.value.begin(), field.value.end());
  }
  return fields;
}

json Terms(const RadianceSettings& settings, const Fields& fields) {
  json terms = json::array();
  ForEachTerm([&]<typename M> {
    RadianceSettings on = settings;
    M::Switch(on, true);
    json term = {{"name", M::kName}, {"scale", M::Factor(on) * 2 * on.r_max_rad}, {"reads_stretch", ReadsStretch<M>}};
    if constexpr (PixelTerm<M>) {
      const auto& place = fields.place[static_cast<std::size_t>(MeasureList::IndexOf<M>())];
      term["define"] = shader::TermOf(M::kName);
      term["shape"] = M::ShapeOf(on).Packed();
      term["field"] = {place.x(), place.y(), place.z()};
    } else {
      static_assert(std::is_same_v<M, measure::Time>, "page/renderer.js, photoTerms, knows time alone");
      term["time"] = {
          {"window_s", on.time_window_s}, {"core", on.time_core}, {"least", on.time_least}, {"period_s", on.period_s}};
    }
    terms.push_back(term);
  });
  return terms;
}

json Settings(const RadianceSettings& s) {
  json terms = json::object();
  ForEachTerm([&]<typename M> { terms[std::string(M::kName)] = M::On(s); });
  return {{"k", s.k > 0 ? std::min(s.k, 12) : 12},
          {"alpha", s.alpha},
          {"gamma", s.gamma},
          {"feather", s.fov_feather},
          {"field_of_view", s.field_of_view},
          {"visibility", s.visibility},
          {"exposure", s.exposure},
          {"prefilter", s.prefilter},
          {"falling_leaves", s.correlation == Correlation::kFallingLeaves},
          {"jacobian", s.resolution == Resolution::kJacobian},
          {"cell_px", kCellPx},
          {"terms", terms}};
}

// R(h) as the shader reads it (GlLumigraph::UploadLeaves).
json Leaves(const RadianceSettings& s) {
  const FallingLeaves leaves(s.r_min_rad, s.r_max_rad);
  const double from = std::log2(1e-6 * std::max(s.r_min_rad, 1e-6 * s.r_max_rad)), to = std::log2(2 * s.r_max_rad);
  std::vector<float> table;
  for (int i = 0; i <= kLeafSteps; ++i)
    table.push_back(static_cast<float>(std::pow(leaves.PSame(std::exp2(from + (to - from) * i / kLeafSteps)), 0.4)));
  table.back() = 0;
  return {{"place", {kLeafSteps / (to - from), -from * kLeafSteps / (to - from)}},
          {"table", table},
          {"r_max", s.r_max_rad}};
}

double TypicalDepth(const Scene& scene) {
  std::vector<double> depths;
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    const std::vector<double> of_view = PointDepths(scene, {static_cast<std::int32_t>(i)});
    if (!of_view.empty()) depths.push_back(of_view[of_view.size() / 2]);
  }
  return depths.empty() ? 1 : Median(depths) * scene.normalized_from_world.scale;
}

json Pose(const RenderView& view) {
  const Eigen::Matrix3d m = Directions(view);
  // K R = m: by Gram-Schmidt from the optical axis, as page/math.js does.
  const Eigen::Vector3d z = m.row(2).transpose().normalized();
  const Eigen::Vector3d row0 = m.row(0).transpose();
  const Eigen::Vector3d x = (row0 - row0.dot(z) * z).normalized();
  Eigen::Matrix3d rotation;
  rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  return {{"centre", Numbers(view.centre)},
          {"rotation", Rows(rotation)},
          {"focal", std::sqrt(std::abs(m.determinant())) / view.size_px.minCoeff()},
          {"aspect", static_cast<double>(view.size_px.x()) / view.size_px.y()}};
}

json Photos(const ReducedPhotos& reduced, const Sources& sources, bool previews, std::vector<WebPart>& parts) {
  json photos = json::array();
  for (std::size_t i = 0; i < reduced.photos.size(); ++i) {
    const PagePhoto& photo = reduced.photos[i];
    const View& view = reduced.scene.views[i];
    const RenderView& source = sources.views[i];
    const Eigen::Matrix3d m = Directions(source);
    const Eigen::Vector3f color = SourceColor(reduced.view[i]);
    json about = {{"name", view.name},
                  {"size", {photo.size_px.x(), photo.size_px.y()}},
                  {"centre", Numbers(source.centre)},
                  {"m", Rows(m)},
                  {"focal_px", std::sqrt(std::abs(m.determinant()))},
                  {"gain", source.gain},
                  {"turns", QuarterTurns(view.orientation)},
                  {"color", {color.x(), color.y(), color.z()}}};
    if (view.time_s) about["time_s"] = *view.time_s;
    const auto add = [&](const std::string& jpeg, const Eigen::Vector2i& size, int halvings) {
      const std::string name = fmt::format("photos/{:05}-{}.jpg", i, halvings);
      about["levels"].push_back(
          {{"part", name}, {"size", {size.x(), size.y()}}, {"shift", halvings}, {"bytes", jpeg.size()}});
      parts.push_back({name, jpeg});
    };
    add(photo.jpeg, photo.size_px, 0);
    if (previews && photo.size_px.minCoeff() >= 64) {
      const Image8 small = BuildPyramid(DecodeJpeg(photo.jpeg), kPreviewHalvings + 1).back();
      add(EncodeJpeg(small, kPreviewQuality), {small.width, small.height}, kPreviewHalvings);
    }
    photos.push_back(about);
  }
  return photos;
}

std::string Reduced(const PhotoReduction& r, int photos) {
  std::string text;
  if (r.every > 1) text += fmt::format("one photo of {}, ", r.every);
  if (r.scale < 1) text += fmt::format("photos at {:.0f} % of their width, ", 100 * r.scale);
  return text + DescribeQuality(r, photos);
}

// Of text inside a <script>: what could end it.
std::string Inert(std::string text) {
  std::string inert;
  inert.reserve(text.size());
  for (const char c : text)
    if (c == '<')
      inert += "\\u003c";
    else
      inert += c;
  return inert;
}

}  // namespace

WebPage MakeWebPage(const Lumigraph& lumigraph, const ReducedPhotos& reduced, const QuantisedMesh& mesh,
                    const CameraPath& path, const WebPageOptions& options) {
  const RadianceSettings& settings = lumigraph.settings();
  const Scene& scene = reduced.scene;
  const Sources sources = MakeSources(scene);
  const Fields fields = FieldsOf(sources);
  WebPage page;
  json j = {{"lumigraph_web", kWebVersion},
            {"made_by", fmt::format("lumi-export {}", kVersion)},
            {"title", NameOfFolder(lumigraph.scene().folder)},
            {"up", Numbers(scene.normalized_from_world.rotation * scene.up)},
            {"typical_depth", TypicalDepth(lumigraph.scene())},
            {"near_depth", kNearDepth},
            {"photos", Photos(reduced, sources, options.previews, page.parts)},
            {"settings", Settings(settings)},
            {"terms", Terms(settings, fields)},
            {"shaders", Shaders()},
            {"reduced", Reduced(reduced.reduction, static_cast<int>(reduced.photos.size()))}};
  if (options.memory_mb > 0) j["memory_mb"] = options.memory_mb;
  j["near"] = kNearest * j["typical_depth"].get<double>();
  j["proxy"] = {{"name", lumigraph.proxy_name()},  {"vertices", mesh.mesh.vertices.size()},
                {"faces", mesh.mesh.faces.size()}, {"bytes", mesh.bytes_a_coordinate},
                {"least", Numbers(mesh.least)},    {"step", Numbers(mesh.step)}};
  page.parts.push_back({"proxy.bin", mesh.bytes});
  if (!fields.values.empty()) {
    j["fields"] = fields.values.size();
    page.parts.push_back({"fields.bin", std::string(reinterpret_cast<const char*>(fields.values.data()),
                                                    fields.values.size() * sizeof(float))});
  }
  if (CanOcclude(mesh.mesh)) {
    const int side = VisibilityMaps::SuggestedSide(static_cast<int>(scene.views.size()));
    const Eigen::Vector2i first = sources.views.front().size_px;
    const Eigen::Vector2d size = first.cast<double>() * side / first.maxCoeff();
    j["visibility"] = {{"size", {std::max(1L, std::lround(size.x())), std::max(1L, std::lround(size.y()))}}};
  }
  if (settings.correlation == Correlation::kFallingLeaves) j["leaves"] = Leaves(settings);
  for (const Effect& effect : lumigraph.effects())
    j["effects"].push_back({{"name", effect.name}, {"on", effect.on}, {"evidence", Reason(effect)}});
  const Eigen::Vector2i film = FilmSize(lumigraph.scene());
  for (int i = 0; i < kPathKeys; ++i) {
    const PathKey key = PoseOnPath(path, Duration(path) * i / (kPathKeys - 1));
    j["path"].push_back(Pose(Normalized(MakeRenderView(key, film.x(), film.y()), scene.normalized_from_world)));
  }
  j["path_seconds"] = Duration(path);
  std::vector<double> times;
  for (const View& view : scene.views)
    if (view.time_s) times.push_back(*view.time_s);
  if (!times.empty() && settings.time) {
    const auto [least, most] = std::ranges::minmax(times);
    const double end = settings.period_s > 0 ? least + settings.period_s : most;
    if (end > least) j["time"] = {{"begin_s", least}, {"end_s", end}};
  }
  page.manifest = Inert(j.dump(-1, ' ', true, json::error_handler_t::replace));
  return page;
}

}  // namespace lumi
