// Scenes, meshes and views as arrays.
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <string>

#include "python/core/arrays.h"
#include "python/core/bind.h"
#include "python/core/photo_name.h"
#include "python/core/progress.h"
#include "render/holdout/holdout.h"
#include "render/lumigraph/lumigraph.h"
#include "render/path/path_frames.h"
#include "scene/files/image_io.h"
#include "scene/files/mesh_io.h"
#include "scene/files/scene_folder.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;

py::array_t<std::uint8_t> ArrayOfImage(Image8&& image) {
  const Shape shape{image.height, image.width, image.channels};
  return ArrayOf(std::move(image.data), shape);
}

// ---------------------------------------------------------------------------------------------------------- meshes

Mesh MeshFrom(const Doubles& vertices,
              const py::array_t<std::int32_t, py::array::c_style | py::array::forcecast>& faces,
              const std::optional<py::array_t<std::uint8_t, py::array::c_style>>& colors) {
  if (vertices.ndim() != 2 || vertices.shape(1) != 3) throw py::value_error("vertices must have the shape (n, 3)");
  if (faces.ndim() != 2 || faces.shape(1) != 3) throw py::value_error("faces must have the shape (n, 3)");
  Mesh mesh;
  for (py::ssize_t i = 0; i < vertices.shape(0); ++i)
    mesh.vertices.emplace_back(vertices.data()[3 * i], vertices.data()[3 * i + 1], vertices.data()[3 * i + 2]);
  for (py::ssize_t i = 0; i < faces.shape(0); ++i)
    mesh.faces.push_back({faces.data()[3 * i], faces.data()[3 * i + 1], faces.data()[3 * i + 2]});
  if (colors) {
    if (colors->ndim() != 2 || colors->shape(1) != 3 || colors->shape(0) != vertices.shape(0))
      throw py::value_error("colors must have the shape of vertices");
    for (py::ssize_t i = 0; i < colors->shape(0); ++i)
      mesh.colors.push_back({colors->data()[3 * i], colors->data()[3 * i + 1], colors->data()[3 * i + 2]});
  }
  if (const auto problem = Validate(mesh)) throw py::value_error(*problem);
  return mesh;
}

void BindMesh(py::module_& m) {
  py::class_<Mesh, std::shared_ptr<Mesh>>(m, "Mesh", "Triangles: the form that every proxy takes.")
      .def(py::init(&MeshFrom), py::arg("vertices"), py::arg("faces"), py::arg("colors") = py::none(),
           "vertices: (n, 3), world units. faces: (m, 3), numbers of vertices, counter-clockwise seen from outside. "
           "colors: (n, 3) uint8, RGB.")
      .def_property_readonly(
          "vertices",
          [](const py::object& self) {
            const auto& mesh = self.cast<const Mesh&>();
            return ArrayOver(reinterpret_cast<const double*>(mesh.vertices.data()),
                             {static_cast<py::ssize_t>(mesh.vertices.size()), 3}, self);
          },
          "(n, 3) float64, world units; no copy.")
      .def_property_readonly(
          "faces",
          [](const py::object& self) {
            const auto& mesh = self.cast<const Mesh&>();
            return ArrayOver(reinterpret_cast<const std::int32_t*>(mesh.faces.data()),
                             {static_cast<py::ssize_t>(mesh.faces.size()), 3}, self);
          },
          "(m, 3) int32, numbers of vertices; no copy.")
      .def_property_readonly(
          "colors",
          [](const py::object& self) {
            const auto& mesh = self.cast<const Mesh&>();
            return ArrayOver(reinterpret_cast<const std::uint8_t*>(mesh.colors.data()),
                             {static_cast<py::ssize_t>(mesh.colors.size()), 3}, self);
          },
          "(n, 3) uint8, RGB, or (0, 3); no copy.")
      .def_property_readonly("closed", &IsClosed, "Whether each edge is shared by two faces.")
      .def(
          "save", [](const Mesh& mesh, const fs::path& file) { WriteMesh(file, mesh); }, py::arg("file"),
          py::call_guard<py::gil_scoped_release>(), "Writes PLY or OBJ, by the file's ending.")
      .def_static(
          "read", [](const fs::path& file) { return ReadMesh(file); }, py::arg("file"),
          py::call_guard<py::gil_scoped_release>(), "Reads PLY or OBJ.");
}

// ----------------------------------------------------------------------------------------------------------- views

RenderView ViewFrom(const Doubles& P, const Eigen::Vector2i& size_px, std::optional<double> time_s, double gain) {
  RenderView view;
  view.P = MatrixFrom<3, 4>(P, "P");
  view.size_px = size_px;
  view.time_s = time_s;
  view.gain = gain;
  const Eigen::Vector4d centre = CentreOfProjection(view.P);
  if (!(centre.w() > 1e-12)) throw py::value_error("P has no finite centre of projection");
  view.centre = centre.head<3>() / centre.w();
  return view;
}

Eigen::Vector2i SizeFrom(const std::pair<int, int>& size_px) {
  if (size_px.first < 1 || size_px.second < 1 || size_px.first > kMaxPictureSide || size_px.second > kMaxPictureSide)
    throw py::value_error("size_px takes (width, height), 1 to " + std::to_string(kMaxPictureSide));
  return {size_px.first, size_px.second};
}

void BindView(py::module_& m) {
  py::class_<RenderView>(m, "View",
                         "A camera that a picture is rendered from: a projection matrix and a size. Pixel centres lie "
                         "at (i + 0.5, j + 0.5); the camera looks along z, x to the right, y down.")
      .def(py::init([](const Doubles& P, const std::pair<int, int>& size_px, std::optional<double> time_s,
                       double gain) { return ViewFrom(P, SizeFrom(size_px), time_s, gain); }),
           py::arg("P"), py::arg("size_px"), py::arg("time_s") = py::none(), py::arg("gain") = 1.0,
           "P: (3, 4), pixels from world, w > 0 in front. size_px: (width, height). time_s: seconds, of scenes that "
           "carry times. gain: exposure, relative to the scene's.")
      .def_static(
          "from_camera",
          [](const Doubles& K, const Doubles& cam_from_world, const std::pair<int, int>& size_px,
             std::optional<double> time_s, double gain) {
            RenderView view;
            const Eigen::Matrix<double, 3, 4> pose = MatrixFrom<3, 4>(cam_from_world, "cam_from_world");
            view.P = MatrixFrom<3, 3>(K, "K") * pose;
            view.centre = -pose.leftCols<3>().transpose() * pose.col(3);
            view.size_px = SizeFrom(size_px);
            view.time_s = time_s;
            view.gain = gain;
            return view;
          },
          py::arg("K"), py::arg("cam_from_world"), py::arg("size_px"), py::arg("time_s") = py::none(),
          py::arg("gain") = 1.0, "K: (3, 3), pixels. cam_from_world: (3, 4), [R t].")
      .def_static(
          "look_at",
          [](const Doubles& eye, const Doubles& target, const Doubles& up, double vertical_fov_deg,
             const std::pair<int, int>& size_px, std::optional<double> time_s) {
            PathKey key;
            key.cam_from_world =
                LookAt(MatrixFrom<3, 1>(eye, "eye"), MatrixFrom<3, 1>(target, "target"), MatrixFrom<3, 1>(up, "up"));
            key.vertical_fov_rad = vertical_fov_deg * kRadPerDeg;
            const Eigen::Vector2i size = SizeFrom(size_px);
            RenderView view = MakeRenderView(key, size.x(), size.y());
            view.time_s = time_s;
            return view;
          },
          py::arg("eye"), py::arg("target"), py::arg("up"), py::arg("vertical_fov_deg"), py::arg("size_px"),
          py::arg("time_s") = py::none(),
          "From `eye` to `target`, `up` upwards in the picture: (3,) each, world units.")
      .def_property_readonly(
          "P",
          [](const RenderView& v) { return ArrayOfEach(1, [&](std::size_t) { return v.P; }).attr("__getitem__")(0); },
          "(3, 4) float64, pixels from world.")
      .def_property_readonly(
          "centre",
          [](const RenderView& v) { return ArrayOf(std::vector<double>(v.centre.begin(), v.centre.end()), {3}); },
          "(3,) float64, world units.")
      .def_property_readonly(
          "size_px", [](const RenderView& v) { return std::pair(v.size_px.x(), v.size_px.y()); }, "(width, height).")
      .def_readwrite("time_s", &RenderView::time_s, "Seconds, or None.")
      .def_readwrite("gain", &RenderView::gain, "Exposure, relative to the scene's.")
      .def("__repr__", [](const RenderView& v) {
        return "View(" + std::to_string(v.size_px.x()) + "x" + std::to_string(v.size_px.y()) + ")";
      });
}

// ---------------------------------------------------------------------------------------------------------- scenes

template <typename Get>
auto OfViews(const Scene& scene, Get&& get) {
  return ArrayOfEach(scene.views.size(), [&](std::size_t i) { return get(scene.views[i]); });
}

// A member of every point, without a copy.
template <typename T>
py::array_t<T> OfPoints(const py::object& self, const T* first, py::ssize_t width) {
  const auto n = static_cast<py::ssize_t>(self.cast<const Scene&>().points.size());
  if (width == 1) return ArrayOver(first, {n}, {sizeof(Point)}, self);
  return ArrayOver(first, {n, width}, {sizeof(Point), sizeof(T)}, self);
}
// What a scene without points points to.
const Point kNoPoint;
const Point& FirstPoint(const py::object& self) {
  const auto& points = self.cast<const Scene&>().points;
  return points.empty() ? kNoPoint : points.front();
}

py::tuple Observations(const Scene& scene) {
  std::vector<std::int32_t> view, point;
  std::vector<double> x_px;
  for (std::size_t p = 0; p < scene.points.size(); ++p)
    for (const Observation& o : scene.points[p].track) {
      view.push_back(o.view.value);
      point.push_back(static_cast<std::int32_t>(p));
      x_px.insert(x_px.end(), {o.x_px.x(), o.x_px.y()});
    }
  const auto n = static_cast<py::ssize_t>(view.size());
  return py::make_tuple(ArrayOf(std::move(view), {n}), ArrayOf(std::move(point), {n}),
                        ArrayOf(std::move(x_px), {n, 2}));
}

void RequireWidth(int width) {
  if (width < 0 || width > kMaxPictureSide)
    throw py::value_error("width takes 1 to " + std::to_string(kMaxPictureSide) + ", or 0: as it is");
}

std::vector<RenderView> Frames(const Scene& scene, const fs::path& file, double seconds, double fps, int width) {
  RequireWidth(width);
  if (!(seconds > 0 && seconds <= 3600) || !(fps > 0 && fps <= 240))
    throw py::value_error("seconds takes up to 3600, fps up to 240");
  if (const auto matrices = MatrixPathFor(scene, file, fps)) return FramesOfPath(scene, *matrices, width, 0);
  return FramesOfPath(scene, file.empty() ? PathThroughPhotos(scene, seconds, fps) : ReadCameraPath(file), width, 0);
}

RenderView PhotoView(const Scene& scene, const PhotoName& name, int width) {
  RequireWidth(width);
  const View& view = scene.views[static_cast<std::size_t>(ViewCalled(scene, name.text))];
  return PhotosView(scene, view, SizeFor(width, 0, SizePx(scene, view)));
}

void BindPointsOf(py::class_<Scene, std::shared_ptr<Scene>>& scene) {
  scene
      .def_property_readonly(
          "points",
          [](const py::object& self) {
            RequireMetric(self.cast<const Scene&>(), "this array");
            return OfPoints(self, FirstPoint(self).x_in_world.data(), 3);
          },
          "(m, 3) float64, world units, of metric scenes; no copy.")
      .def_property_readonly(
          "points_homogeneous",
          [](const py::object& self) {
            if (self.cast<const Scene&>().frame == Frame::kMetric)
              throw UsageError("a metric scene's points are Scene.points");
            return OfPoints(self, FirstPoint(self).X_in_world.data(), 4);
          },
          "(m, 4) float64, of scenes without a metric; no copy.")
      .def_property_readonly(
          "point_colors", [](const py::object& self) { return OfPoints(self, FirstPoint(self).color.data(), 3); },
          "(m, 3) uint8, RGB; no copy.")
      .def_property_readonly(
          "point_errors_px", [](const py::object& self) { return OfPoints(self, &FirstPoint(self).error_px, 1); },
          "(m,) float64, mean reprojection error, pixels; no copy.")
      .def("observations", &Observations,
           "Where photos see points: (view (o,) int32, point (o,) int32, x_px (o, 2) float64).");
}

void BindViewsOf(py::class_<Scene, std::shared_ptr<Scene>>& scene) {
  const auto metric = [](const Scene& s, auto&& get) {
    RequireMetric(s, "this array");
    return OfViews(s, get);
  };
  scene
      .def_property_readonly(
          "names",
          [](const Scene& s) {
            std::vector<PhotoName> names;
            for (const View& v : s.views) names.push_back({v.name});
            return names;
          },
          "The photos' names, sorted; all arrays of photos are in this order.")
      .def_property_readonly(
          "size_px",
          [](const Scene& s) {
            std::vector<std::int32_t> sizes;
            for (const View& v : s.views) {
              const Eigen::Vector2i size = SizePx(s, v);
              sizes.insert(sizes.end(), {size.x(), size.y()});
            }
            return ArrayOf(std::move(sizes), {static_cast<py::ssize_t>(s.views.size()), 2});
          },
          "(n, 2) int32, width and height of each photo.")
      .def_property_readonly(
          "K",
          [metric](const Scene& s) {
            return metric(s, [&](const View& v) -> Eigen::Matrix3d { return s.CameraOf(v).K(); });
          },
          "(n, 3, 3) float64, pixels.")
      .def_property_readonly(
          "cam_from_world",
          [metric](const Scene& s) { return metric(s, [](const View& v) { return v.cam_from_world.Matrix(); }); },
          "(n, 3, 4) float64, [R t].")
      .def_property_readonly(
          "P", [](const Scene& s) { return OfViews(s, [&](const View& v) { return MakeRenderView(s, v).P; }); },
          "(n, 3, 4) float64, pixels from world, w > 0 in front.")
      .def_property_readonly(
          "centres",
          [](const Scene& s) {
            return OfViews(s, [&](const View& v) -> Eigen::Vector3d { return MakeRenderView(s, v).centre; });
          },
          "(n, 3) float64, centres of projection, world units.")
      .def_property_readonly(
          "times_s", [](const Scene& s) { return OfViews(s, [](const View& v) { return v.time_s.value_or(NAN); }); },
          "(n,) float64, seconds; NaN where a photo has no time.")
      .def_property_readonly(
          "gains", [](const Scene& s) { return OfViews(s, [](const View& v) { return v.gain; }); },
          "(n,) float64, exposure of each photo, relative to the scene's.");
}

}  // namespace

void BindScene(py::module_& m) {
  BindMesh(m);
  BindView(m);
  py::class_<Scene, std::shared_ptr<Scene>> scene(m, "Scene", "Photos, their cameras and sparse points.");
  BindViewsOf(scene);
  BindPointsOf(scene);
  scene
      .def_property_readonly(
          "folder", [](const Scene& s) { return s.folder; }, "Where it was read from.")
      .def_property_readonly(
          "frame", [](const Scene& s) { return std::string(Name(s.frame)); }, "metric, quasi_affine or projective.")
      .def_property_readonly(
          "up", [](const Scene& s) { return ArrayOf(std::vector<double>(s.up.begin(), s.up.end()), {3}); },
          "(3,) float64, unit, in world.")
      .def_property_readonly(
          "normalized_from_world",
          [](const Scene& s) {
            const Similarity3& n = s.normalized_from_world;
            Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
            matrix.topLeftCorner<3, 3>() = n.scale * n.rotation.toRotationMatrix();
            matrix.topRightCorner<3, 1>() = n.translation;
            return ArrayOfEach(1, [&](std::size_t) { return matrix; }).attr("__getitem__")(0);
          },
          "(4, 4) float64: moves the scene to its centre, size about 1.")
      .def_readonly("period_s", &Scene::period_s, "Seconds, of what repeats itself, or None.")
      .def_readonly("active_proxy", &Scene::active_proxy, "Name of the proxy that is rendered over, or empty.")
      .def_property_readonly(
          "proxies", [](const Scene& s) { return ListProxies(s.folder); }, "Names of the scene's proxies.")
      .def(
          "proxy", [](const Scene& s, const std::string& name) { return LoadProxy(s, name); }, py::arg("name") = "",
          py::call_guard<py::gil_scoped_release>(), "A proxy by name, a mesh file, or (empty) the active one.")
      .def(
          "photo_file",
          [](const Scene& s, const PhotoName& name) {
            return s.ImagePath(s.views[static_cast<std::size_t>(ViewCalled(s, name.text))]);
          },
          py::arg("name"), "The photo's file: by its name, or by its position as text.")
      .def(
          "read_photo",
          [](const Scene& s, const PhotoName& name) {
            const fs::path file = s.ImagePath(s.views[static_cast<std::size_t>(ViewCalled(s, name.text))]);
            Image8 image;
            {
              const py::gil_scoped_release others_may_run;
              image = ReadImage8(file, 3);
            }
            return ArrayOfImage(std::move(image));
          },
          py::arg("name"), "(height, width, 3) uint8, RGB, as stored.")
      .def("view", &PhotoView, py::arg("name"), py::arg("width") = 0,
           "The camera of a photo, for pictures of its own size, or so many pixels wide.")
      .def("path", &Frames, py::arg("file") = fs::path(), py::arg("seconds") = 12.0, py::arg("fps") = 30.0,
           py::arg("width") = 0,
           "The views along a path: of a file (camera path or projection matrices), or through the photos' own "
           "cameras; as lumi-render has them.")
      .def("__len__", [](const Scene& s) { return s.views.size(); })
      .def("__repr__", [](const Scene& s) {
        return "Scene(" + std::to_string(s.views.size()) + " photos, " + std::to_string(s.points.size()) + " points)";
      });
  m.def(
      "open_scene",
      [](const fs::path& path, bool rescale_cameras, py::object progress) {
        return WithProgress(std::move(progress), [&](ProgressSink& sink) {
          OpenOptions options;
          options.rescale_cameras = rescale_cameras;
          return std::make_shared<Scene>(OpenScene(path, options, sink));
        });
      },
      py::arg("path"), py::arg("rescale_cameras") = false, py::arg("progress") = py::none(),
      "Opens a scene of ours, a COLMAP workspace or a transforms.json; nothing is written to it.");
}

}  // namespace lumi
