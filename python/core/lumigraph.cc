// A lumigraph: pictures, weights and measures of any view, as arrays.
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>

#include "python/core/arrays.h"
#include "python/core/bind.h"
#include "python/core/opened.h"
#include "python/core/photo_name.h"
#include "python/core/progress.h"
#include "render/commands/render_command.h"
#include "render/picture/convert.h"
#include "render/radiance/setting_words.h"
#include "render/settings_json.h"
#include "scene/files/image_io.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using Names = PhotoNames;

// A dictionary of JSON text.
py::object FromJson(const std::string& text) { return py::module_::import("json").attr("loads")(text); }

// Settings as they stand on a line: {"k": 4, "fov": True, "r_max_deg": 2.5}.
Words WordsFrom(const py::dict& settings) {
  Words words;
  for (const auto& [key, value] : settings) {
    std::string name = py::str(key).cast<std::string>();
    std::ranges::replace(name, '_', '-');
    words[name] =
        py::isinstance<py::bool_>(value) ? (value.cast<bool>() ? "on" : "off") : py::str(value).cast<std::string>();
  }
  return words;
}

void BindPicture(py::module_& m) {
  py::class_<ShownPicture, std::shared_ptr<ShownPicture>>(m, "Picture", "What Lumigraph.render gives.")
      .def_property_readonly(
          "rgba",
          [](const py::object& self) {
            const ImageF& image = self.cast<const ShownPicture&>().rgba;
            return ArrayOver(image.data.data(), {image.height, image.width, 4}, self);
          },
          "(height, width, 4) float32 in [0, 1], premultiplied by alpha; a hole is 0. No copy.")
      .def_property_readonly(
          "rgb",
          [](const ShownPicture& p) {
            Image8 image;
            {
              const py::gil_scoped_release others_may_run;
              image = ToRgb8(p.rgba);
            }
            const Shape shape{image.height, image.width, 3};
            return ArrayOf(std::move(image.data), shape);
          },
          "(height, width, 3) uint8 over black: what figures are computed on.")
      .def_readonly("ms", &ShownPicture::ms, "Milliseconds that it took.")
      .def_readonly("samples", &ShownPicture::samples, "Rays at which weights were computed; 0: every pixel.")
      .def(
          "save",
          [](const ShownPicture& p, const fs::path& file) {
            if (file.extension() == ".exr")
              WriteImage(file, p.rgba);
            else
              WriteImage(file, file.extension() == ".png" ? ToRgba8(p.rgba) : ToRgb8(p.rgba));
          },
          py::arg("file"), py::call_guard<py::gil_scoped_release>(),
          "Writes PNG (with alpha), JPEG or EXR, by the file's ending, as lumi-render does.");
}

void BindWeights(py::module_& m) {
  py::class_<ViewPlan, std::shared_ptr<ViewPlan>>(m, "Plan", "What each pixel of a picture is blended from.")
      .def_property_readonly(
          "photos",
          [](const py::object& self) {
            const auto& p = self.cast<const ViewPlan&>();
            return ArrayOver(p.photo.data(), {p.height, p.width, p.k}, self);
          },
          "(height, width, k) int32, numbers of the scene's photos, -1 past the last; no copy.")
      .def_property_readonly(
          "weights",
          [](const py::object& self) {
            const auto& p = self.cast<const ViewPlan&>();
            return ArrayOver(p.weight.data(), {p.height, p.width, p.k}, self);
          },
          "(height, width, k) float32, sum 1 where alpha is above 0; the optimum's may be negative. No copy.")
      .def_property_readonly(
          "alpha",
          [](const py::object& self) {
            const auto& p = self.cast<const ViewPlan&>();
            return ArrayOver(p.alpha.data(), {p.height, p.width}, self);
          },
          "(height, width) float32 in [0, 1]; 0: a hole. No copy.")
      .def_property_readonly(
          "depth",
          [](const py::object& self) {
            const auto& p = self.cast<const ViewPlan&>();
            return ArrayOver(p.depth.data(), {p.height, p.width}, self);
          },
          "(height, width) float64, of the proxy along the view's axis: world units, or those of the picture's own "
          "world "
          "where it has one; NaN where the proxy is missed. No copy.")
      .def_property_readonly(
          "points",
          [](const py::object& self) {
            const auto& p = self.cast<const ViewPlan&>();
            return ArrayOver(p.point.data(), {p.height, p.width, 3}, self);
          },
          "(height, width, 3) float64, where each ray meets the proxy, world units; NaN where the ray misses it, and "
          "everywhere where each picture has a proxy of its own. No copy.");
  py::class_<WeightsAtRays, std::shared_ptr<WeightsAtRays>>(
      m, "RayWeights", "Photos and weights at rays: those of ray i are the entries first[i] to first[i + 1].")
      .def_property_readonly(
          "first",
          [](const py::object& self) {
            const auto& t = self.cast<const WeightsAtRays&>().table;
            return ArrayOver(t.first.data(), {static_cast<py::ssize_t>(t.first.size())}, self);
          },
          "(n + 1,) int32; no copy.")
      .def_property_readonly(
          "photos",
          [](const py::object& self) {
            const auto& t = self.cast<const WeightsAtRays&>().table;
            return ArrayOver(t.camera.data(), {static_cast<py::ssize_t>(t.camera.size())}, self);
          },
          "(entries,) int32, numbers of the scene's photos; no copy.")
      .def_property_readonly(
          "weights",
          [](const py::object& self) {
            const auto& t = self.cast<const WeightsAtRays&>().table;
            return ArrayOver(t.weight.data(), {static_cast<py::ssize_t>(t.weight.size())}, self);
          },
          "(entries,) float32; no copy.")
      .def_property_readonly(
          "alpha",
          [](const py::object& self) {
            const auto& t = self.cast<const WeightsAtRays&>().table;
            return ArrayOver(t.alpha.data(), {static_cast<py::ssize_t>(t.alpha.size())}, self);
          },
          "(n,) float32; 0: no photo sees the point. No copy.")
      .def_property_readonly(
          "points",
          [](const py::object& self) {
            const auto& at = self.cast<const WeightsAtRays&>();
            return ArrayOver(at.point.data(), {static_cast<py::ssize_t>(at.point.size() / 3), 3}, self);
          },
          "(n, 3) float64, where the rays meet the proxy, world units; NaN where they miss it. No copy.")
      .def(
          "dense",
          [](const WeightsAtRays& at, int photos) {
            const auto n = static_cast<py::ssize_t>(at.table.size());
            for (const std::int32_t photo : at.table.camera) photos = std::max(photos, photo + 1);
            std::vector<float> all(static_cast<std::size_t>(n) * static_cast<std::size_t>(photos), 0.0F);
            for (std::size_t i = 0; i < at.table.size(); ++i)
              for (std::int32_t e = at.table.first[i]; e < at.table.first[i + 1]; ++e)
                all[i * static_cast<std::size_t>(photos) +
                    static_cast<std::size_t>(at.table.camera[static_cast<std::size_t>(e)])] =
                    at.table.weight[static_cast<std::size_t>(e)];
            return ArrayOf(std::move(all), {n, photos});
          },
          py::arg("photos") = 0,
          "(n, photos) float32: a column a photo, at least so many, up to the last one that counts anywhere.");
}

// ------------------------------------------------------------------------------------------------------- lumigraphs

LumigraphOptions OptionsFrom(const fs::path& scene, const Words& settings, const std::string& effects,
                             std::optional<double> phase, std::optional<int> window_frames, bool rescale_cameras,
                             int memory_mb) {
  LumigraphOptions o;
  o.scene = scene;
  o.effects = effects;
  o.phase = phase;
  o.window_frames = window_frames;
  o.rescale_cameras = rescale_cameras;
  o.memory_mb = memory_mb;
  ApplySettingWords(settings, o.settings, o.decided);
  // Who names a time wants it to count.
  if ((o.decided.Has("time-s") || phase) && !o.decided.Has("time")) {
    o.settings.time = true;
    o.decided.Add("time");
  }
  if (window_frames) o.decided.Add("window-frames");
  return o;
}

std::vector<Eigen::Vector2d> PixelsFrom(const Doubles& xy_px) {
  if (xy_px.ndim() != 2 || xy_px.shape(1) != 2) throw py::value_error("xy_px must have the shape (n, 2)");
  std::vector<Eigen::Vector2d> pixels;
  for (py::ssize_t i = 0; i < xy_px.shape(0); ++i) pixels.emplace_back(xy_px.data()[2 * i], xy_px.data()[2 * i + 1]);
  return pixels;
}

// The arguments that all methods about a view have.
py::arg View() { return py::arg("view"); }
py::arg_v LeaveOut() { return py::arg("leave_out") = Names(); }
py::arg_v Settings() { return py::arg("settings") = py::dict(); }

void BindReading(py::class_<OpenedLumigraph, std::shared_ptr<OpenedLumigraph>>& c) {
  c.def_property_readonly(
       "scene", [](const OpenedLumigraph& o) -> const Scene& { return o.lumigraph().scene(); },
       py::return_value_policy::reference_internal, "Its photos and cameras.")
      .def_property_readonly(
          "proxy_name", [](const OpenedLumigraph& o) { return o.lumigraph().proxy_name(); },
          "The proxy that it is rendered over; per-view: each picture has its own.")
      .def_property_readonly(
          "mesh",
          [](const OpenedLumigraph& o) -> const Mesh* {
            return o.lumigraph().one_mesh() ? &o.lumigraph().mesh() : nullptr;
          },
          py::return_value_policy::reference_internal, "That proxy's triangles, or None.")
      .def_property_readonly(
          "settings",
          [](OpenedLumigraph& o) {
            std::string text;
            {
              const py::gil_scoped_release others_may_run;
              text = o.Settings().Text();
            }
            return FromJson(text);
          },
          "A dictionary of the options of the reconstruction, by the names that lumi-render gives them; `settings=` "
          "and "
          "--settings take it back.")
      .def_property_readonly(
          "effects",
          [](OpenedLumigraph& o) {
            std::vector<Effect> effects;
            {
              const py::gil_scoped_release others_may_run;
              effects = o.Effects();
            }
            py::list list;
            for (const Effect& e : effects) list.append(FromJson(JsonKeys(e).Text()));
            return list;
          },
          "Which measures count and why, as lumi-render's summary has it; empty before the first picture.")
      .def("__repr__",
           [](const OpenedLumigraph& o) {
             return "Lumigraph(" + std::to_string(o.lumigraph().scene().views.size()) + " photos, proxy " +
                    o.lumigraph().proxy_name() + ")";
           })
      .def("device", &OpenedLumigraph::Device, py::arg("backend") = "cpu", py::call_guard<py::gil_scoped_release>(),
           "What renders: processor and registers, or OpenGL's name of the device.")
      .def(
          "photo",
          [](const py::object& self, const PhotoName& name, int level) {
            const Lumigraph& l = self.cast<const OpenedLumigraph&>().lumigraph();
            if (!l.one_mesh() || l.cache() != nullptr)
              throw UsageError("the photos are not held in memory", "Scene.read_photo reads one");
            const auto& levels = l.photos()[static_cast<std::size_t>(ViewCalled(l.scene(), name.text))].levels;
            if (level < 0 || level >= static_cast<int>(levels.size()))
              throw py::index_error("the photo has levels 0 to " + std::to_string(levels.size() - 1));
            const Image8& image = levels[static_cast<std::size_t>(level)];
            return ArrayOver(image.data.data(), {image.height, image.width, image.channels}, self);
          },
          py::arg("name"), py::arg("level") = 0,
          "(height, width, 3) uint8: the photo as pictures are blended from it, corrected for white balance and "
          "vignetting where these count; level 1 is half as wide, and so on. No copy.");
}

void BindMaking(py::class_<OpenedLumigraph, std::shared_ptr<OpenedLumigraph>>& c) {
  c.def(
       "choose_measures",
       [](OpenedLumigraph& o, const std::vector<RenderView>& views, const Names& leave_out) {
         const py::gil_scoped_release others_may_run;
         o.ChooseMeasures(views, TextsOf(leave_out));
       },
       py::arg("views"), LeaveOut(),
       "Decides for these views which measures count, for all pictures from now on. Without it each picture has what "
       "its own view calls for.")
      .def(
          "render",
          [](OpenedLumigraph& o, const RenderView& view, const Names& leave_out, const std::string& show,
             const std::string& backend, const py::dict& settings) {
            const Words words = WordsFrom(settings);
            const py::gil_scoped_release others_may_run;
            return o.Render(view, TextsOf(leave_out), show, backend, words);
          },
          View(), LeaveOut(), py::arg("show") = "color", py::arg("backend") = "cpu", Settings(),
          "A picture of the view. Names in leave_out are photos that are not used; show: color, false-color, "
          "tessellation or proxy.")
      .def(
          "plan",
          [](OpenedLumigraph& o, const RenderView& view, const Names& leave_out, const py::dict& settings) {
            const Words words = WordsFrom(settings);
            const py::gil_scoped_release others_may_run;
            return o.Plan(view, TextsOf(leave_out), words);
          },
          View(), LeaveOut(), Settings(),
          "Photos, weights and points of every pixel; a grid of sparse samples in the settings does not count.")
      .def(
          "weights_at",
          [](OpenedLumigraph& o, const RenderView& view, const Doubles& xy_px, const Names& leave_out,
             const py::dict& settings) {
            const std::vector<Eigen::Vector2d> pixels = PixelsFrom(xy_px);
            const Words words = WordsFrom(settings);
            const py::gil_scoped_release others_may_run;
            return o.At(view, pixels, TextsOf(leave_out), words);
          },
          View(), py::arg("xy_px"), LeaveOut(), Settings(),
          "Photos and weights at these points of the view's picture, (n, 2) pixels; with the setting similarity=full "
          "the optimum's.")
      .def(
          "measure_map",
          [](OpenedLumigraph& o, const std::string& measure, const RenderView& view, const PhotoName& photo,
             const Names& leave_out, const py::dict& settings) {
            const Words words = WordsFrom(settings);
            MeasureMap map;
            {
              const py::gil_scoped_release others_may_run;
              map = o.MapOf(view, measure, photo.text, TextsOf(leave_out), words);
            }
            return py::make_tuple(ArrayOf(std::move(map.values), {map.image.height, map.image.width}), map.unit);
          },
          py::arg("measure"), View(), py::arg("photo") = PhotoName(), LeaveOut(), Settings(),
          "A measure's value at each pixel, of a photo or of the one that weighs most: ((height, width) float32, NaN "
          "where there is none, its unit).");
}

// lumi-render --holdout, without pictures.
py::object Evaluate(const fs::path& scene, const std::string& holdout, const std::string& fold,
                    const std::string& proxy, int width, const py::dict& settings, const std::string& effects,
                    const std::string& backend, py::object progress) {
  RenderOptions o;
  static_cast<LumigraphOptions&>(o) =
      OptionsFrom(scene, WordsFrom(settings), effects, std::nullopt, std::nullopt, false, 0);
  o.proxy = proxy;
  o.holdout = HoldoutFrom(holdout);
  if (!fold.empty()) {
    o.fold = fold;
    o.decided.Add("fold");
  }
  o.width_px = width;
  o.backend = backend;
  const std::string text =
      WithProgress(std::move(progress), [&](ProgressSink& sink) { return JsonKeys(RunRender(o, sink)).Text(); });
  return FromJson(text);
}

py::list DescribeSettings() {
  py::list list;
  for (const SettingOption& s : SettingOptions()) {
    py::dict option;
    option["name"] = s.name;
    option["value"] = s.value;
    option["help"] = s.help;
    option["default"] = s.fallback;
    option["choices"] = s.choices;
    list.append(option);
  }
  return list;
}

}  // namespace

void BindLumigraph(py::module_& m) {
  BindPicture(m);
  BindWeights(m);
  py::class_<OpenedLumigraph, std::shared_ptr<OpenedLumigraph>> c(
      m, "Lumigraph", "A scene opened for rendering: its proxy, photos, and the measures chosen for it.");
  c.def(py::init([](const fs::path& scene, const py::object& proxy, const py::dict& settings,
                    const std::string& effects, std::optional<double> phase, std::optional<int> window_frames,
                    bool rescale_cameras, int memory_mb, bool along_matrices, py::object progress) {
          const LumigraphOptions options =
              OptionsFrom(scene, WordsFrom(settings), effects, phase, window_frames, rescale_cameras, memory_mb);
          const Mesh* mesh = py::isinstance<Mesh>(proxy) ? &proxy.cast<const Mesh&>() : nullptr;
          const std::string name =
              proxy.is_none() || mesh != nullptr ? std::string() : py::str(proxy).cast<std::string>();
          return WithProgress(std::move(progress), [&](ProgressSink& sink) {
            return std::make_shared<OpenedLumigraph>(options, name, mesh, along_matrices, sink);
          });
        }),
        py::arg("scene"), py::arg("proxy") = py::none(), Settings(), py::arg("effects") = "auto",
        py::arg("phase") = py::none(), py::arg("window_frames") = py::none(), py::arg("rescale_cameras") = false,
        py::arg("memory_mb") = -1, py::arg("along_matrices") = false, py::arg("progress") = py::none());
  BindReading(c);
  BindMaking(c);
  m.def("_evaluate", &Evaluate, py::arg("scene"), py::arg("holdout"), py::arg("fold"), py::arg("proxy"),
        py::arg("width"), py::arg("settings"), py::arg("effects"), py::arg("backend"), py::arg("progress"));
  m.def("setting_options", &DescribeSettings,
        "The settings of the reconstruction: name, value, help, default, choices of each.");
  m.def(
      "measures",
      [] {
        py::dict maps;
        for (const HeatMap& map : HeatMaps()) maps[py::str(std::string(map.name))] = std::string(map.help);
        return maps;
      },
      "What Lumigraph.measure_map takes, with a line of help each.");
}

}  // namespace lumi
