#include "pipeline/report/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "pipeline/report/cameras_from_above.h"
#include "pipeline/report/contact_sheet.h"
#include "pipeline/report/html.h"
#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/files/scene_folder.h"
#include "scene/program/error.h"
#include "scene/program/version.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr int kThumbnailWidthPx = 320;
constexpr std::size_t kMaxSheetRows = 16;   // spread evenly over what there is
constexpr std::size_t kMaxMissingRows = 200;
constexpr std::size_t kMaxGaps = 12;

json Parse(const StageResult& stage) { return json::parse(stage.json, nullptr, false); }

json StageJson(const ReportInput& input, const std::string& name) {
  for (const StageResult& stage : input.stages)
    if (stage.name == name) return Parse(stage);
  return json::object();
}

// The stage that gave the cameras: reconstruct (timeperiodic starts it itself), or import.
json CamerasJson(const ReportInput& input) {
  const json reconstruct = StageJson(input, "reconstruct"), timed = StageJson(input, "timeperiodic");
  if (timed.contains("reconstruct")) return timed["reconstruct"];
  return reconstruct.empty() ? StageJson(input, "import") : reconstruct;
}

double Number(const json& j, const char* key, double fallback = 0) {
  const auto it = j.find(key);
  return it != j.end() && it->is_number() ? it->get<double>() : fallback;
}

std::string Text(const json& j, const char* key) {
  const auto it = j.find(key);
  if (it == j.end() || it->is_null()) return {};
  return it->is_string() ? it->get<std::string>() : it->dump();
}

template <typename T>
std::vector<T> SpreadEvenly(const std::vector<T>& all, std::size_t most) {
  if (all.size() <= most) return all;
  std::vector<T> some;
  for (std::size_t i = 0; i < most; ++i) some.push_back(all[i * all.size() / most]);
  return some;
}

std::vector<SheetRow> SheetRows(const ReportInput& input, const Scene& scene, const json& holdout) {
  std::vector<SheetRow> rows;
  if (holdout.contains("views"))
    for (const json& view : holdout["views"]) {
      SheetRow row;
      row.name = Text(view, "name");
      row.photo = scene.image_folder / row.name;
      row.render = input.holdout_folder / (Text(view, "file") + "_render.jpg");
      row.difference = input.holdout_folder / (Text(view, "file") + "_difference.jpg");
      rows.push_back(row);
    }
  if (rows.empty())
    for (const View& view : scene.views) rows.push_back({view.name, scene.ImagePath(view), {}, {}});
  return SpreadEvenly(rows, kMaxSheetRows);
}

std::string ContactSheetHtml(const std::vector<SheetThumbnails>& rows) {
  if (rows.empty()) return {};
  const bool compared = rows.front().pictures.size() == 3;
  std::string html = compared ? "<p class=\"soft\">Photos that were left out, and what the others make of the same view. "
                                "Differences are amplified.</p>\n<div class=\"frame\"><div class=\"sheet\">"
                                "<div class=\"head\">photo</div><div class=\"head\">rendered from the others</div><div class=\"head\">difference</div>\n"
                              : "<div class=\"frame\"><div class=\"sheet photos\">\n";
  static constexpr const char* kWhat[] = {"photo", "rendered", "difference"};
  for (const SheetThumbnails& row : rows) {
    if (compared) html += "<div class=\"name\">" + EscapeHtml(row.name) + "</div>";
    for (std::size_t k = 0; k < row.jpegs.size(); ++k)
      html += HtmlInlineJpeg(row.jpegs[k], row.name + ", " + kWhat[std::min<std::size_t>(k, 2)]) + "\n";
  }
  return html + "</div></div>\n";
}

std::string HoldoutHtml(const json& holdout) {
  if (!holdout.contains("views") || holdout["views"].empty()) return {};
  std::vector<std::vector<std::string>> rows;
  constexpr double kBarPxADecibel = 4;
  const auto db = [](double value) { return fmt::format("{:.2f}", value); };
  for (const json& view : holdout["views"]) {
    const double psnr = Number(view, "psnr_db");
    rows.push_back({EscapeHtml(Text(view, "name")), fmt::format("<span class=\"bar\" style=\"width:{:.0f}px\"></span>", std::max(0.0, psnr) * kBarPxADecibel),
                    db(psnr), view.contains("nearest_photo_psnr_db") ? db(Number(view, "nearest_photo_psnr_db")) : "",
                    fmt::format("{:.3f}", Number(view, "ssim")), fmt::format("{:.1f} %", 100 * Number(view, "coverage"))});
  }
  rows.push_back({"mean", "", db(Number(holdout, "psnr_mean_db")), db(Number(holdout, "nearest_photo_psnr_mean_db")),
                  fmt::format("{:.3f}", Number(holdout, "ssim_mean")), fmt::format("{:.1f} %", 100 * Number(holdout, "coverage"))});
  return "<p class=\"soft\">Over all pixels at the photo's own size; a hole counts as black. The baseline is the nearest photo alone, "
         "reprojected through the same proxy.</p>\n" +
         HtmlTable({{"held-out photo"}, {""}, {"PSNR, dB", true}, {"nearest photo, dB", true}, {"SSIM", true}, {"coverage", true}}, rows, true);
}

std::string MissingHtml(const json& cameras) {
  if (!cameras.contains("missing") || !cameras["missing"].is_array() || cameras["missing"].empty()) return {};
  std::vector<std::vector<std::string>> rows;
  for (const json& photo : cameras["missing"]) {
    if (rows.size() == kMaxMissingRows) {
      rows.push_back({fmt::format("and {} more", cameras["missing"].size() - kMaxMissingRows), "see report.json", ""});
      break;
    }
    rows.push_back({EscapeHtml(Text(photo, "name")), EscapeHtml(Text(photo, "reason")), EscapeHtml(Text(photo, "hint"))});
  }
  std::string html = HtmlTable({{"photo"}, {"why"}, {"what to try"}}, rows);
  if (cameras.contains("components") && cameras["components"].is_array() && cameras["components"].size() > 1)
    html += "<p>COLMAP split the photos into parts that do not hang together; this scene is one of them (lumi-pipeline --component picks another).</p>\n";
  return html;
}

std::string TimeHtml(const ReportInput& input) {
  std::vector<std::vector<std::string>> rows;
  double total = 0, largest = 1e-9;
  for (const double s : input.computed_seconds) total += s, largest = std::max(largest, s);
  constexpr double kBarPx = 320;
  for (std::size_t i = 0; i < input.stages.size(); ++i) {
    const double s = input.computed_seconds[i];
    rows.push_back({EscapeHtml(input.stages[i].name), fmt::format("<span class=\"bar\" style=\"width:{:.0f}px\"></span>", s / largest * kBarPx),
                    fmt::format("{:.1f}", s)});
  }
  rows.push_back({"together", "", fmt::format("{:.1f}", total)});
  std::string html = HtmlTable({{"stage"}, {""}, {"seconds", true}}, rows, true);
  if (input.colmap_seconds > 0)
    html += fmt::format("<p class=\"soft\">COLMAP itself took {:.1f} s; preparation and proxy around it {:.1f} s, {:.1f} % of that.</p>\n",
                        input.colmap_seconds, input.around_colmap_seconds, 100 * input.around_colmap_seconds / input.colmap_seconds);
  return html;
}

// What each program recorded: version and options, one table a stage.
json ReadProvenance(const fs::path& scene_folder) {
  json all = json::object();
  std::error_code error;
  for (fs::directory_iterator it(scene_folder / "provenance", error), end; !error && it != end; it.increment(error)) {
    if (it->path().extension() != ".json") continue;
    json record = json::parse(ReadText(it->path()), nullptr, false);
    if (!record.is_object() || !record.contains("options")) continue;
    json kept;
    for (const char* key : {"version", "options", "seconds"})
      if (record.contains(key)) kept[key] = record[key];
    all[it->path().stem().string()] = kept;
  }
  return all;
}

std::string OptionsHtml(const json& provenance) {
  std::string html;
  for (const auto& [stage, record] : provenance.items()) {
    std::vector<std::vector<std::string>> rows{{"version", EscapeHtml(Text(record, "version"))}};
    if (record.contains("options"))
      for (const auto& [key, value] : record["options"].items())
        rows.push_back({EscapeHtml(key), EscapeHtml(value.is_string() ? value.get<std::string>() : value.dump())});
    html += "<details><summary>" + EscapeHtml(stage) + "</summary>" + HtmlTable({{"option"}, {"value"}}, rows) + "</details>\n";
  }
  return html;
}

// How a scene that moves is covered in space and time, as lumi-timeperiodic says it; its plots are in the page.
std::string SamplingHtml(const ReportInput& input) {
  const json timed = StageJson(input, "timeperiodic");
  if (!timed.contains("sampling")) return {};
  const json& sampling = timed["sampling"];
  std::vector<std::vector<std::string>> rows{
      {"period", fmt::format("{:.6g} &#177; {:.2g} frames, {:.4g} s (from the {})", Number(timed, "period_frames"), Number(timed, "period_sigma_frames"), Number(timed, "period_s"),
                             EscapeHtml(Text(timed, "period_from")))},
      {"photos in a window of one frame", fmt::format("{:.3g} on average, {:.0f} to {:.0f}", Number(sampling, "samples_per_window"), Number(sampling, "window_least"), Number(sampling, "window_most"))},
      {"uniformity of the space-time plane", fmt::format("{:.2f} (1: as good as chance; {:.0f} % of its cells have a photo)", Number(sampling, "uniformity"), 100 * Number(sampling, "covered"))}};
  if (timed.contains("masks") && timed["masks"].contains("moving_share"))
    rows.push_back({"of the picture moves", fmt::format("{:.1f} %", 100 * Number(timed["masks"], "moving_share"))});
  std::string html = HtmlTable({{"space and time"}, {""}}, rows);
  for (const char* plot : {"sampling.svg", "period.svg"}) {
    std::error_code error;
    const fs::path file = input.scene_folder / "timeperiodic" / plot;
    if (!fs::is_regular_file(file, error)) continue;
    html += "<div class=\"frame\">" + HtmlInlineSvg(ReadText(file), plot) + "</div>\n";
  }
  std::string list;
  if (timed.contains("warnings"))
    for (const json& w : timed["warnings"])
      if (w.is_string()) list += "<li>" + EscapeHtml(w.get<std::string>()) + "</li>";
  std::size_t gaps = 0;
  if (sampling.contains("gaps"))
    for (const json& gap : sampling["gaps"])
      if (++gaps <= kMaxGaps) list += "<li>gap: " + EscapeHtml(Text(gap, "what_to_film")) + "</li>";
  if (gaps > kMaxGaps) list += fmt::format("<li>and {} more gaps: report.json has them</li>", gaps - kMaxGaps);
  return list.empty() ? html : html + "<ul>" + list + "</ul>\n";
}

std::string CardsHtml(const ReportInput& input, const json& cameras, const json& holdout) {
  std::string cards = "<div class=\"cards\">";
  const auto backend = Text(cameras, "backend");
  cards += HtmlCard(fmt::format("{:.0f} of {:.0f}", Number(cameras, "images_registered"), Number(cameras, "images_total")), "photos have a camera",
                    backend.empty() ? "" : "by " + EscapeHtml(backend));
  cards += HtmlCard(fmt::format("{:.2f} px", Number(cameras, "mean_reprojection_error_px")), "mean reprojection error");
  if (holdout.contains("psnr_mean_db")) {
    const double psnr = Number(holdout, "psnr_mean_db"), nearest = Number(holdout, "nearest_photo_psnr_mean_db", psnr);
    cards += HtmlCard(fmt::format("{:.1f} dB", psnr), "PSNR of held-out photos", fmt::format("{:+.1f} dB against the nearest photo", psnr - nearest));
    cards += HtmlCard(fmt::format("{:.3f}", Number(holdout, "ssim_mean")), "SSIM");
    cards += HtmlCard(fmt::format("{:.1f} %", 100 * Number(holdout, "coverage")), "coverage");
  }
  if (const json calibration = StageJson(input, "calibrate"); calibration.contains("fx"))
    cards += HtmlCard(fmt::format("{:.1f} &#177; {:.1f} px", Number(calibration, "fx"), Number(calibration, "sigma_fx")), "focal length, calibrated",
                      "see <a href=\"calibration/report.html\">its report</a>");
  const json proxy = StageJson(input, "proxy");
  if (proxy.contains("faces")) cards += HtmlCard(Text(proxy, "faces"), "faces in the proxy", EscapeHtml(Text(proxy, "name")));
  return cards + "</div>\n";
}

// What both backends found, where both have run in this folder.
std::string BackendsHtml(const json& cameras) {
  if (!cameras.contains("compared_with")) return {};
  const json& other = cameras["compared_with"];
  const std::vector<std::vector<std::string>> rows{
      {EscapeHtml(Text(cameras, "backend")), fmt::format("{:.2f}", Number(cameras, "mean_reprojection_error_px")), fmt::format("{:.1f}", Number(cameras, "seconds"))},
      {EscapeHtml(Text(other, "backend")), fmt::format("{:.2f}", Number(other, "mean_reprojection_error_px")), fmt::format("{:.1f}", Number(other, "seconds"))}};
  return HtmlTable({{"backend"}, {"reprojection error, px"}, {"seconds"}}, rows) +
         fmt::format("<p>After alignment, over the {:.0f} photos that both placed: centres {:.3f} % of their extent apart (rms), rotations {:.3f} degrees.</p>\n",
                     Number(other, "views"), Number(other, "centre_rms_percent"), Number(other, "rotation_rms_deg"));
}

std::string NextHtml(const ReportInput& input, const json& cameras) {
  const std::string scene = input.scene_folder.string();
  std::string html = "<p>Walk through it:</p><pre>lumi-view " + EscapeHtml(scene) + "</pre>\n";
  if (!input.video.empty()) html += "<p>A fly-through is in <a href=\"" + EscapeHtml(input.video.filename().string()) + "\">" + EscapeHtml(input.video.filename().string()) + "</a>.</p>\n";
  html += "<p>See which photo is used where, or render a path of your own:</p><pre>lumi-render " + EscapeHtml(scene) +
          " -o false-color.mp4 --show false-color\nlumi-render " + EscapeHtml(scene) + " -o frames --path PATH.json</pre>\n";
  if (Number(cameras, "images_registered") < Number(cameras, "images_total"))
    html += "<p>Photos that are missing can come in with more overlap: shoot between them and their neighbours, and run the same command again.</p>\n";
  return html;
}

}  // namespace

ReportFiles WriteReport(const ReportInput& input, ProgressSink& progress) {
  OpenOptions open;
  open.check_photos = false;
  open.undistort = false;
  const Scene scene = OpenScene(input.scene_folder, open, progress);
  const json cameras = CamerasJson(input), holdout = StageJson(input, "holdout"), provenance = ReadProvenance(input.scene_folder);
  std::set<std::string> held_out;
  if (holdout.contains("views"))
    for (const json& view : holdout["views"]) held_out.insert(Text(view, "name"));

  const std::vector<SheetThumbnails> thumbnails = MakeThumbnails(SheetRows(input, scene, holdout), kThumbnailWidthPx, progress);

  ReportFiles files;
  files.html = input.scene_folder / "report.html";
  files.json = input.scene_folder / "report.json";

  const std::string title = fs::weakly_canonical(fs::absolute(input.scene_folder)).filename().string();
  std::string map = CamerasFromAboveSvg(scene, held_out);
  if (!map.empty())
    map = "<div class=\"frame\">" + map + "</div><p class=\"soft\"><span class=\"key\" style=\"background:var(--cool)\"></span>camera" +
          (held_out.empty() ? "" : "<span class=\"key\" style=\"background:var(--accent)\"></span>held out for evaluation") +
          fmt::format("<span class=\"key\" style=\"background:var(--soft)\"></span>{} points in space</p>\n", scene.points.size());

  std::string body = "<h1>" + EscapeHtml(title) + "</h1>\n<p class=\"soft\">A lumigraph of " + EscapeHtml(input.source.string()) +
                     ", made by lumi-pipeline " + kVersion + "</p>\n";
  body += CardsHtml(input, cameras, holdout);
  body += HtmlSection("What to do next", NextHtml(input, cameras));
  body += HtmlSection("Cameras seen from above", map);
  body += HtmlSection("The two backends", BackendsHtml(cameras));
  body += HtmlSection("Space and time", SamplingHtml(input));
  body += HtmlSection("Photos without a camera", MissingHtml(cameras));
  body += HtmlSection("Contact sheet", ContactSheetHtml(thumbnails));
  body += HtmlSection("Held-out photos", HoldoutHtml(holdout));
  body += HtmlSection("Time", TimeHtml(input));
  body += HtmlSection("Options and versions", OptionsHtml(provenance));

  ordered_json report;
  report["schema"] = "lumi-pipeline-report";
  report["version"] = kVersion;
  report["scene"] = input.scene_folder.string();
  report["source"] = input.source.string();
  report["stages"] = json::array();
  for (std::size_t i = 0; i < input.stages.size(); ++i)
    report["stages"].push_back({{"name", input.stages[i].name}, {"seconds", input.computed_seconds[i]}, {"summary", Parse(input.stages[i])}});
  report["colmap_seconds"] = input.colmap_seconds;
  report["around_colmap_seconds"] = input.around_colmap_seconds;
  report["provenance"] = provenance;

  const FolderLock lock(input.scene_folder);
  if (!thumbnails.empty()) {
    files.contact_sheet = input.scene_folder / "contact-sheet.jpg";
    WriteImage(files.contact_sheet, ComposeSheet(thumbnails, 4));
  }
  WriteTextAtomically(files.html, HtmlPage(title + " - lumigraph", body));
  WriteTextAtomically(files.json, report.dump(2, ' ', false, json::error_handler_t::replace) + "\n");
  return files;
}

}  // namespace lumi
