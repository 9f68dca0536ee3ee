#include "pipeline/price.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pipeline/input_kind.h"
#include "pipeline/pipeline.h"
#include "pipeline/qualities.h"
#include "pipeline/sibling_summaries.h"
#include "scene/files/atomic_file.h"
#include "scene/program/error.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

constexpr double kNone = CostAndQuality::kNone;

struct PricedQuality {
  PipelineQuality quality;
  double minutes = kNone, camera_minutes = kNone, proxy_minutes = kNone;
  std::string dominates;  // "proxy (71 %)"
  std::string photos;     // "24 of 24"
  double psnr_db = kNone, psnr_seen_db = kNone, ssim = kNone;
  std::string failed;
};

// What this program says of its stages' work, in minutes.
PricedQuality PriceOf(const PipelineQuality& quality, const PipelineSummary& summary) {
  PricedQuality row{.quality = quality};
  row.minutes = row.camera_minutes = row.proxy_minutes = 0;
  double most = 0;
  std::string stage;
  for (const StageResult& s : summary.stages) {
    const double minutes = s.computed_seconds / 60;
    row.minutes += minutes;
    if (s.name == "reconstruct" || s.name == "timeperiodic" || s.name == "import") {
      row.camera_minutes += minutes;
      auto cameras = s.summary.As<sibling::CamerasSummary>();
      if (const auto timed = s.summary.As<sibling::TimedSummary>(); timed.reconstruct) cameras = *timed.reconstruct;
      row.photos = fmt::format("{} of {}", cameras.images_registered, cameras.images_total);
    }
    if (s.name == "proxy" || s.name == "simplify") row.proxy_minutes += minutes;
    if (s.name == "holdout") {
      const auto held_out = s.summary.As<sibling::HoldoutSummary>();
      row.psnr_db = held_out.psnr_mean_db.value_or(kNone);
      row.psnr_seen_db = held_out.psnr_seen_mean_db.value_or(kNone);
      row.ssim = held_out.ssim_mean;
    }
    if (minutes > most) {
      most = minutes;
      stage = s.name;
    }
  }
  if (row.minutes > 0) row.dominates = fmt::format("{} ({:.0f} %)", stage, 100 * most / row.minutes);
  return row;
}

TradeoffTable TableOf(const std::vector<PricedQuality>& rows) {
  using enum TradeoffRole;
  using Row = PricedQuality;
  TradeoffTable table = TradeoffTableOf<Row>(
      {{{"name", kSetting, "quality", -10, "{}", "quality"}, [](const Row& r) { return r.quality.name; }},
       {{"what", kSetting, "", 0, "{}", "-"}, [](const Row& r) { return r.quality.says; }},
       {{"minutes", kCost, "minutes", 9, "{:.2f}"}, &Row::minutes},
       {{"camera_minutes", kFigure, "cameras", 9, "{:.2f}"}, &Row::camera_minutes},
       {{"proxy_minutes", kFigure, "proxy", 9, "{:.2f}"}, &Row::proxy_minutes},
       {{"dominates", kFigure, "most of it", -18}, &Row::dominates},
       {{"photos", kFigure, "photos", 12}, &Row::photos},
       {{"psnr_db", kMoreIsBetter, "PSNR dB", 9, "{:.2f}"}, &Row::psnr_db},
       {{"psnr_seen_db", kMoreIsBetter, "seen dB", 9, "{:.2f}"}, &Row::psnr_seen_db},
       {{"ssim", kMoreIsBetter, "SSIM", 7, "{:.3f}"}, &Row::ssim},
       {{"", kRemark, "", 1}, [](const Row& r) { return r.quality.says; }},
       {{"failed", kFailed, "", 1}, &Row::failed}},
      rows);
  table.rows_key = "qualities";
  table.starred = "front";
  table.MarkFront("minutes", "psnr_db");
  return table;
}

Plot PictureOf(const TradeoffTable& table) {
  TradeoffPanel panel;
  panel.title = "The whole pipeline";
  panel.subtitle = "left-out photos against minutes";
  panel.x = "minutes";
  panel.x_axis = {"minutes", true};
  panel.y = "psnr_db";
  panel.y_axis = {"held-out PSNR, dB"};
  panel.label = "name";
  panel.series = {{"", "qualities", "#24292f"}};
  panel.front = table.Front("minutes", "psnr_db");
  return PlotOf(table, panel);
}

}  // namespace

PipelinePrice RunPipelinePrice(const PipelineOptions& options, ProgressSink& progress) {
  if (const std::string wrong = Validate(options); !wrong.empty()) throw UsageError(wrong);
  if (options.output.empty())
    throw UsageError("-o OUT is missing", "name the folder that a scene a quality goes to");
  if (options.holdout == 0) throw UsageError("--tradeoff compares left-out photos, and --holdout 0 leaves none out");
  RequireOurFolder(options.output, "tradeoff");
  const bool has_cameras = ClassifyInput(options.input) != InputKind::kCapture;
  const std::vector<PipelineQuality> qualities = QualitiesFor(options, has_cameras);
  std::error_code error;
  fs::create_directories(options.output / "tradeoff", error);  // the folder is ours from here on
  if (error)
    throw MachineError(fmt::format("cannot be made: {}", error.message()), "choose another output", options.output);

  std::vector<PricedQuality> rows;
  std::exception_ptr first_failure;
  for (const PipelineQuality& quality : qualities) {
    PipelineOptions run = WithQuality(options, quality, has_cameras);
    run.minutes.reset();
    run.output = options.output / quality.name;
    progress.Message(fmt::format("quality {} of {}: {} ({})", rows.size() + 1, qualities.size(), quality.name,
                                 quality.says));
    try {
      rows.push_back(PriceOf(quality, RunPipeline(run, progress)));
    } catch (const Interrupted&) {
      throw;
    } catch (const Error& e) {
      // What is wrong with the input or the machine is wrong with all of them.
      if (e.code() != ExitCode::kDataRefused) throw;
      if (!first_failure) first_failure = std::current_exception();
      rows.push_back({.quality = quality, .failed = e.what()});
      continue;
    }
    if (options.minutes && rows.back().minutes > *options.minutes) break;
  }

  PipelinePrice price{.table = TableOf(rows)};
  std::vector<CostAndQuality> measured;
  for (const PricedQuality& r : rows) measured.push_back({r.minutes, r.psnr_db});
  if (ParetoFront(measured).empty()) {
    if (first_failure) std::rethrow_exception(first_failure);
    throw DataError("too few photos have a camera: none could be left out", "take more photos");
  }
  const Recommended best = RecommendedRow(measured, options.minutes);
  price.recommended = rows[best.row].quality.name;
  price.scene = options.output / price.recommended;
  price.fits = best.fits;
  price.table.facts = {{"input", options.input.string()}, {"recommended", price.recommended}};
  if (options.minutes) price.table.facts.emplace_back("minutes_asked", *options.minutes);
  price.files = WriteTradeoff(options.output / "tradeoff" / "pipeline", price.table, {PictureOf(price.table)});
  return price;
}

void ListKeys(JsonKeys& j, PipelinePrice& price) {
  j.Append(KeysOf(price.table));
  j("scene", price.scene, "fits", price.fits);
  j("json", price.files.json, "csv", price.files.csv, "svg", price.files.svg);
}

std::string Describe(const PipelinePrice& price) {
  return TextOf(price.table) + fmt::format("\n{}: {} ({}; picture: {})\n", price.fits ? "recommended" : "the cheapest, and it takes longer than was asked",
                                           price.recommended, price.scene.string(), price.files.svg.string());
}

}  // namespace lumi
