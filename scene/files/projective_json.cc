#include "scene/files/projective_json.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>

#include "scene/files/file_name.h"
#include "scene/files/json_fields.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

using json_fields::Fields;
using json_fields::Json;
using json_fields::ParseJson;
using json_fields::RequireFormat;

constexpr const char* kFormat = "lumigraph-projective";
constexpr int kProjectiveVersion = 1;
constexpr int kMaxSidePx = 1 << 20;

// What is wrong with a view or a point, or nullptr; the same for reading and writing.
const char* Wrong(const View& view) {
  if (!view.P.allFinite()) return "P is not made of finite numbers";
  const double largest = view.P.cwiseAbs().maxCoeff();
  if (!(largest > 0) || !(CentreOfProjection(view.P / largest).norm() > 0.5))
    return "P is no projection matrix: its rank is below 3";
  if (view.size_px.minCoeff() < 1 || view.size_px.maxCoeff() > kMaxSidePx)
    return "width_px, height_px is no size of a photo";
  return nullptr;
}
const char* Wrong(const Point& point, Frame frame, std::size_t views) {
  if (!point.X_in_world.allFinite() || point.X_in_world.isZero(0)) return "X is no point";
  if (frame == Frame::kQuasiAffine && !(point.X_in_world.w() > 0))
    return "X has no w > 0, which a quasi-affine frame has";
  if (!(point.error_px >= 0) || !std::isfinite(point.error_px)) return "error_px is not 0 or more";
  for (const Observation& o : point.track) {
    if (o.view.value < 0 || static_cast<std::size_t>(o.view.value) >= views)
      return "views names a view that is not there";
    if (!o.x_px.allFinite()) return "x_px is not made of finite numbers";
  }
  return nullptr;
}
bool IsPlane(const Eigen::Vector4d& plane) { return plane.allFinite() && !plane.isZero(0); }

template <int n>
Eigen::Matrix<double, n, 1> Required(const Fields& fields, const char* key) {
  const auto v = fields.Vector<n>(key);
  if (!v) throw fields.Wrong(key, "there");
  return *v;
}

const Json& RequiredArray(const Fields& fields, const char* key) {
  const Json* array = fields.Array(key);
  if (!array) throw fields.Wrong(key, "there");
  return *array;
}

View ReadView(const Fields& fields) {
  View view;
  const auto name = fields.Text("name");
  if (!name || name->empty()) throw fields.Wrong("name", "a photo's name");
  if (!StaysWithin(*name)) throw fields.Wrong("name", "a photo's name: it leads out of the photos' folder");
  view.name = *name;
  view.size_px = {fields.Integer("width_px").value_or(0), fields.Integer("height_px").value_or(0)};
  view.P = Required<12>(fields, "P").reshaped<Eigen::RowMajor>(3, 4);
  return view;
}

Point ReadPoint(const Fields& fields) {
  Point point;
  point.X_in_world = Required<4>(fields, "X");
  if (const auto color = fields.Vector<3>("color")) {
    if (!(color->minCoeff() >= 0 && color->maxCoeff() <= 255)) throw fields.Wrong("color", "made of bytes");
    for (int k = 0; k < 3; ++k) point.color[static_cast<std::size_t>(k)] = static_cast<std::uint8_t>((*color)[k]);
  }
  point.error_px = fields.Number("error_px").value_or(0);
  const Json& views = RequiredArray(fields, "views");
  const Json& pixels = RequiredArray(fields, "x_px");
  if (pixels.size() != 2 * views.size()) throw fields.Wrong("x_px", "as long as two numbers for each of views");
  point.track.resize(views.size());
  for (std::size_t k = 0; k < views.size(); ++k) {
    if (!views[k].is_number_integer() || !pixels[2 * k].is_number() || !pixels[2 * k + 1].is_number())
      throw fields.Wrong("x_px", "made of numbers, or views of whole ones");
    const auto view = views[k].get<std::int64_t>();
    point.track[k].view.value =
        view >= 0 && view <= std::numeric_limits<std::int32_t>::max() ? static_cast<std::int32_t>(view) : -1;
    point.track[k].x_px = {pixels[2 * k].get<double>(), pixels[2 * k + 1].get<double>()};
  }
  return point;
}

}  // namespace

Scene ReadProjectiveJson(const fs::path& file) {
  const Json json = ParseJson(file);
  const Fields fields(json, file, "");
  RequireFormat(fields, file, kFormat, kProjectiveVersion, "holds no projection matrices of a lumigraph");
  Scene scene;
  const std::string frame = fields.Text("frame").value_or("");
  const auto known = FrameFromName(frame);
  if (!known || *known == Frame::kMetric)
    throw InputError(file, fmt::format("frame \"{}\" is none of quasi_affine, projective", frame));
  scene.frame = *known;
  scene.plane_at_infinity = fields.Vector<4>("plane_at_infinity");
  if (scene.plane_at_infinity && !IsPlane(*scene.plane_at_infinity)) throw fields.Wrong("plane_at_infinity", "a plane");

  const Json& views = RequiredArray(fields, "views");
  for (std::size_t i = 0; i < views.size(); ++i) {
    const std::string where = fmt::format("views[{}].", i);
    scene.views.push_back(ReadView(Fields(views[i], file, where)));
    if (const char* wrong = Wrong(scene.views.back())) throw InputError(file, where + wrong);
  }
  const Json& points = RequiredArray(fields, "points");
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::string where = fmt::format("points[{}].", i);
    scene.points.push_back(ReadPoint(Fields(points[i], file, where)));
    if (const char* wrong = Wrong(scene.points.back(), scene.frame, scene.views.size()))
      throw InputError(file, where + wrong);
  }

  // Sorted by name, as everywhere; tracks follow.
  std::vector<std::int32_t> order(scene.views.size()), place(scene.views.size());
  std::iota(order.begin(), order.end(), 0);
  const auto name = [&](std::int32_t i) -> const std::string& { return scene.views[static_cast<std::size_t>(i)].name; };
  std::sort(order.begin(), order.end(), [&](std::int32_t a, std::int32_t b) { return name(a) < name(b); });
  std::vector<View> sorted;
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (i > 0 && name(order[i]) == name(order[i - 1]))
      throw InputError(file, fmt::format("view \"{}\" comes twice", name(order[i])));
    place[static_cast<std::size_t>(order[i])] = static_cast<std::int32_t>(i);
    sorted.push_back(scene.views[static_cast<std::size_t>(order[i])]);
  }
  scene.views = std::move(sorted);
  for (Point& point : scene.points)
    for (Observation& o : point.track) o.view.value = place[static_cast<std::size_t>(o.view.value)];
  return scene;
}

void WriteProjectiveJson(const Scene& scene, const fs::path& file) {
  if (scene.frame == Frame::kMetric) throw std::invalid_argument("WriteProjectiveJson: a metric scene");
  if (scene.plane_at_infinity && !IsPlane(*scene.plane_at_infinity))
    throw std::invalid_argument("WriteProjectiveJson: plane_at_infinity is no plane");
  const auto numbers = [](const double* begin, Eigen::Index count) {
    return std::vector<double>(begin, begin + count);
  };
  Json head{{"format", kFormat}, {"version", kProjectiveVersion}, {"frame", Name(scene.frame)}};
  if (scene.plane_at_infinity) head["plane_at_infinity"] = numbers(scene.plane_at_infinity->data(), 4);
  // One view, one point a line: readable, and no tree of the whole in memory.
  std::string text = head.dump();
  text.pop_back();
  text += ",\n\"views\":[";
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    const View& view = scene.views[i];
    if (const char* wrong = Wrong(view))
      throw std::invalid_argument(fmt::format("WriteProjectiveJson: {}: {}", view.name, wrong));
    const Eigen::Matrix<double, 3, 4, Eigen::RowMajor> rows = view.P;
    const Json line{{"name", view.name},
                    {"width_px", view.size_px.x()},
                    {"height_px", view.size_px.y()},
                    {"P", numbers(rows.data(), 12)}};
    try {
      text += (i ? ",\n" : "\n") + line.dump();
    } catch (const nlohmann::json::exception&) {
      throw DataError("the photo's name is not UTF-8 and cannot be written into JSON", "rename it", view.name);
    }
  }
  text += "],\n\"points\":[";
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    const Point& point = scene.points[i];
    if (const char* wrong = Wrong(point, scene.frame, scene.views.size()))
      throw std::invalid_argument(fmt::format("WriteProjectiveJson: points[{}]: {}", i, wrong));
    std::vector<std::int32_t> views;
    std::vector<double> pixels;
    for (const Observation& o : point.track) {
      views.push_back(o.view.value);
      pixels.insert(pixels.end(), {o.x_px.x(), o.x_px.y()});
    }
    const Json line{{"X", numbers(point.X_in_world.data(), 4)},
                    {"color", {point.color[0], point.color[1], point.color[2]}},
                    {"error_px", point.error_px},
                    {"views", views},
                    {"x_px", pixels}};
    text += (i ? ",\n" : "\n") + line.dump();
  }
  text += "]}\n";
  WriteTextAtomically(file, text);
}

}  // namespace lumi
