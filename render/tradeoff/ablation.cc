// The rows of Fig. 5-3: the optimum, and one of the five optimisations of sec. 5.1 after the other.
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "render/picture/convert.h"
#include "render/picture/output_name.h"
#include "render/settings_json.h"
#include "render/tradeoff/frame_error.h"
#include "render/tradeoff/measure.h"
#include "render/tradeoff/sweep.h"
#include "render/tradeoff/tradeoff.h"
#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/image_difference/image_difference.h"
#include "scene/plot/plot.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kAblationMarker = "ablation.json";
constexpr int kNearest = 5;  // k of the thesis's fourth row
constexpr int kGrid = 25;    // samples a side of its fifth

struct Row {
  std::string name, what;
  RadianceSettings settings;
};

std::vector<Row> Rows(const RadianceSettings& base) {
  std::vector<Row> rows;
  RadianceSettings s = WithMethod(base, Method::kOptimumPixel);
  s.alpha = s.beta = 1;
  s.k = kNearest;
  s.resolution = Resolution::kJacobian;
  s.resolution_low = 0.5;
  s.resolution_high = 2;
  rows.push_back({"optimum", "all cameras, angle and resolution, at every pixel", s});
  s.similarity = Similarity::kIdentity;
  s.k = 0;
  rows.push_back({"identity", "+ the similarity matrix is the identity", s});
  s.resolution = Resolution::kDistance;
  s.resolution_low = 0.7;
  rows.push_back({"distance", "+ resolution by distance", s});
  s.k = kNearest;
  s.correlation = Correlation::kInverse;
  rows.push_back({"nearest", fmt::format("+ the {} nearest cameras, 1/h", kNearest), s});
  s.grid_columns = s.grid_rows = kGrid;
  s.sampling = Sampling::kInterpolated;
  s.epipoles = true;
  rows.push_back({"sparse", fmt::format("+ {0}x{0} samples and epipoles, interpolated", kGrid), s});
  s.sampling = Sampling::kCandidates;
  rows.push_back({"candidates", fmt::format("the {0}x{0} samples choose cameras, pixels weigh them (ours)", kGrid), s});
  return rows;
}

struct Subject {
  std::string name;
  RenderRequest request;
  std::optional<Image8> photo;
};

Subject Choose(Workbench& bench, const MeasureOptions& o) {
  Subject s;
  const Scene& scene = bench.scene();
  const int width = bench.Width();
  if (!o.path.empty()) {
    s.name = o.path.stem().string();
    s.request.view = FirstOfPath(scene, o.path, width);
    return s;
  }
  if (!o.view.empty()) {
    const auto found = std::find_if(scene.views.begin(), scene.views.end(),
                                    [&](const View& v) { return v.name == o.view || OutputName(v.name) == o.view; });
    if (found == scene.views.end())
      throw UsageError("no photo is called " + o.view, "the first is " + scene.views.front().name);
    Camera camera = scene.CameraOf(*found);
    Image8 photo = ReadImage8(scene.ImagePath(*found), 3);
    if (width < camera.width_px) {
      camera = camera.Scaled(width, HeightFor(camera, width));
      photo = Resize(photo, camera.width_px, camera.height_px);
    }
    s.name = found->name;
    s.request.view = MakeRenderView(camera, found->cam_from_world);
    s.request.view.time_s = found->time_s;
    s.request.view.gain = found->gain;
    s.request.use.assign(scene.views.size(), true);
    s.request.use[static_cast<std::size_t>(found - scene.views.begin())] = false;
    s.photo = std::move(photo);
    return s;
  }
  TestView t = HeldOutViews(scene, o.holdout, Fold::kReport, 1, width).front();
  s.name = t.name;
  s.request.view = t.view;
  s.request.use = t.use;
  s.photo = std::move(t.photo);
  return s;
}

std::string Html(const Json& j) {
  std::string html = fmt::format(
      "<!doctype html><html lang='en'><meta charset='utf-8'><title>Fig. 5-3: {0}</title>\n"
      "<style>body{{font:15px/1.45 "
      "system-ui,sans-serif;margin:2rem;color:#24292f}}table{{border-collapse:collapse}}td,th{{padding:.4rem "
      ".6rem;text-align:left;"
      "vertical-align:top;border-bottom:1px solid "
      "#e4e7ea}}img{{width:300px;display:block}}small{{color:#6a737d}}</style>\n"
      "<h1>What each optimisation costs</h1><p>{0}, {1} px wide, proxy {2}, {3}. Differences are from the first row, "
      "times 4; the squared "
      "error is summed over the "
      "channels, mean over pixels.</p>\n<table><tr><th>row<th>picture<th>false colours<th>difference<th>figures\n",
      Escaped(j["view"]), j["width"].get<int>(), Escaped(j["proxy"]), Escaped(j["device"]));
  for (const Json& r : j["rows"]) {
    html += fmt::format("<tr><td><b>{}</b><br><small>{}</small>", Escaped(r["name"]), Escaped(r["what"]));
    if (r.contains("refused")) {
      html += fmt::format("<td colspan='4'>not available: {}\n", Escaped(r["refused"]));
      continue;
    }
    const auto image = [&](const char* key) {
      return fmt::format("<td><img src='{0}' alt='{0}'>", r[key].get<std::string>());
    };
    html += image("image") + image("false_color") + image("difference");
    html += fmt::format("<td>{:.1f} ms<br>PSNR {:.2f} dB<br>squared error {:.3g}<br>false colours {:.3g}",
                        r["ms"].get<double>(), r["psnr_db"].get<double>(), r["mse"].get<double>(),
                        r["false_color_mse"].get<double>());
    if (r["psnr_photo_db"].is_number()) html += fmt::format("<br>photo {:.2f} dB", r["psnr_photo_db"].get<double>());
    html += "\n";
  }
  return html + "</table></html>\n";
}

}  // namespace

std::string RunAblation(const MeasureOptions& o, ProgressSink& sink) {
  RequireConsistent(o);
  if (o.output.empty()) throw UsageError("-o says where the pictures go");
  Workbench bench(o, kAblationMarker, sink);
  const std::string& proxy = bench.proxies().front();
  Subject subject = Choose(bench, o);
  Renderer& renderer = bench.Measured(proxy);
  const std::vector<Row> rows = Rows(bench.settings());

  Json j = {{"view", subject.name},
            {"proxy", proxy.empty() ? bench.scene().active_proxy : proxy},
            {"backend", o.backend},
            {"device", renderer.Device()},
            {"width", subject.request.view.size_px.x()},
            {"height", subject.request.view.size_px.y()},
            {"rows", Json::array()}};
  std::string csv = "row,what,ms,psnr_db,mse,false_color_mse,ssim,psnr_photo_db,coverage\n";
  std::vector<std::pair<std::filesystem::path, Image8>> pictures;
  std::optional<ImageF> first, first_false_color;
  Progress progress(sink, "rendering the rows", static_cast<long>(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i, progress.Step()) {
    const Row& row = rows[i];
    Json r = {{"name", row.name}, {"what", row.what}, {"settings", bench.ToJson(row.settings)}};
    subject.request.settings = bench.For(subject.request.view, row.settings);
    // The optimum at every pixel is what the others are compared with: from the CPU where OpenGL does not draw it.
    const bool from_cpu = o.backend == "gl" && MethodOf(row.settings) == Method::kOptimumPixel;
    if (from_cpu) r["settings"]["backend"] = "cpu";
    TimedFrame frame;
    ImageF false_color;
    try {
      Renderer& drawing = from_cpu ? bench.Cpu(proxy) : renderer;
      subject.request.show = Show::kColor;
      frame = TimeFrame(drawing, subject.request, o.repeats);
      subject.request.show = Show::kFalseColor;
      false_color = drawing.Render(subject.request);
    } catch (const Interrupted&) {
      throw;
    } catch (const std::exception& e) {
      r["refused"] = e.what();
      sink.Message(row.name + " is not available: " + e.what());
      j["rows"].push_back(r);
      continue;
    }
    if (!first) {
      first = frame.image;
      first_false_color = false_color;
      j["compared_with"] = row.name;
    }
    const FrameError error = ErrorBetween(frame.image, *first);
    const std::string stem = fmt::format("{}-{}", i + 1, row.name);
    r["ms"] = frame.ms;
    r["psnr_db"] = error.psnr_db;
    r["ssim"] = error.ssim;
    r["mse"] = error.mse;
    r["false_color_mse"] = SquaredError(false_color, *first_false_color);
    r["psnr_photo_db"] = subject.photo ? Json(ErrorAgainstPhoto(frame.image, *subject.photo).psnr_db) : Json(nullptr);
    r["coverage"] = Coverage(frame.image);
    r["image"] = stem + ".png";
    r["false_color"] = stem + "-false-color.png";
    r["difference"] = stem + "-difference.png";
    pictures.emplace_back(r["image"].get<std::string>(), ToRgb8(frame.image));
    pictures.emplace_back(r["false_color"].get<std::string>(), ToRgb8(false_color));
    pictures.emplace_back(r["difference"].get<std::string>(), DifferenceImage(ToRgb8(frame.image), ToRgb8(*first)));
    csv += fmt::format("{},\"{}\",{:.4f},{:.4f},{:.6g},{:.6g},{:.6f},{},{:.5f}\n", row.name, row.what, frame.ms,
                       error.psnr_db, error.mse, r["false_color_mse"].get<double>(), error.ssim,
                       r["psnr_photo_db"].dump(), r["coverage"].get<double>());
    j["rows"].push_back(r);
  }
  if (!first) throw DataError("no row could be rendered: " + j["rows"][0]["refused"].get<std::string>());
  // The marker first: a run that ends here leaves a folder that the next one may write into.
  WriteTextAtomically(o.output / kAblationMarker, j.dump(1) + "\n");
  for (const auto& [name, image] : pictures) WriteImage(o.output / name, image);
  WriteTextAtomically(o.output / "ablation.csv", csv);
  WriteTextAtomically(o.output / "index.html", Html(j));
  return j.dump();
}

std::string DescribeAblation(const std::string& json) {
  const Json j = Json::parse(json);
  std::string text = fmt::format("{:<12} {:<58} {:>10} {:>9} {:>12} {:>12}\n", "row", "", "ms", "PSNR dB", "sq. error",
                                 "false colour");
  for (const Json& r : j["rows"])
    text +=
        r.contains("refused")
            ? fmt::format("{:<12} not available: {}\n", r["name"].get<std::string>(), r["refused"].get<std::string>())
            : fmt::format("{:<12} {:<58} {:>10.2f} {:>9.2f} {:>12.4g} {:>12.4g}\n", r["name"].get<std::string>(),
                          r["what"].get<std::string>(), r["ms"].get<double>(), r["psnr_db"].get<double>(),
                          r["mse"].get<double>(), r["false_color_mse"].get<double>());
  text += fmt::format("{}, {} px wide, against the row \"{}\"", j["view"].get<std::string>(), j["width"].get<int>(),
                      j["compared_with"].get<std::string>());
  return text;
}

}  // namespace lumi
