#include "pipeline/price.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <iterator>

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
  std::string in_words = {};
  double minutes = kNone, camera_minutes = kNone, proxy_minutes = kNone;
  std::string dominates = {};  // "proxy (71 %)"
  int placed = 0, photos = 0;
  double choosing_db = kNone;  // the choosing fold's PSNR, by which a quality is recommended
  double psnr_db = kNone, psnr_seen_db = kNone, ssim = kNone;  // the reporting fold's
  std::string failed = {};

  std::string Photos() const { return photos > 0 ? fmt::format("{} of {}", placed, photos) : std::string(); }
};

// What this program says of its stages' work, in minutes.
void TakePrice(const PipelineSummary& summary, PricedQuality& row) {
  row.minutes = row.camera_minutes = row.proxy_minutes = 0;
  double most = 0;
  std::string stage;
  for (const StageResult& s : summary.stages) {
    // The report is written again once the table that it shows exists: it is no part of what a quality costs.
    if (s.name == "report") continue;
    const double minutes = s.computed_seconds / 60;
    row.minutes += minutes;
    if (s.name == "reconstruct" || s.name == "timeperiodic" || s.name == "import") {
      row.camera_minutes += minutes;
      auto cameras = s.summary.As<sibling::CamerasSummary>();
      if (const auto timed = s.summary.As<sibling::TimedSummary>(); timed.reconstruct) cameras = *timed.reconstruct;
      row.placed = cameras.images_registered;
      row.photos = cameras.images_total;
    }
    if (s.name == "depth-maps" || s.name == "proxy" || s.name == "simplify") row.proxy_minutes += minutes;
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
}

// PSNR of the photos that are not reported on; over auto's proxy that was made without them.
double ChoosingPsnr(const fs::path& scene, const PipelineOptions& options, ProgressSink& progress) {
  const StageResult measured =
      RunSiblingStage({"choosing",
                       "lumi-render",
                       {scene.string(), "--holdout", std::to_string(options.holdout), "--fold", "choose", "--backend",
                        options.render_backend, "--threads", std::to_string(options.threads)},
                       1,
                       1,
                       options.executor.get()},
                      progress);
  return measured.summary.As<sibling::HoldoutSummary>().psnr_mean_db.value_or(kNone);
}

TradeoffTable TableOf(const std::vector<PricedQuality>& rows) {
  using enum TradeoffRole;
  using Row = PricedQuality;
  TradeoffTable table = TradeoffTableOf<Row>(
      {{{"name", kSetting, "quality", -10, "{}", "quality"}, [](const Row& r) { return r.quality.name; }},
       {{"minutes", kCost, "minutes", 9, "{:.2f}"}, &Row::minutes},
       {{"camera_minutes", kFigure, "cameras", 9, "{:.2f}"}, &Row::camera_minutes},
       {{"proxy_minutes", kFigure, "proxy", 9, "{:.2f}"}, &Row::proxy_minutes},
       {{"dominates", kFigure, "most of it", -20}, &Row::dominates},
       {{"photos", kFigure, "photos", 12}, &Row::Photos},
       {{"choosing_db", kMoreIsBetter, "chosen by", 10, "{:.2f}"}, &Row::choosing_db},
       {{"psnr_db", kMoreIsBetter, "PSNR dB", 9, "{:.2f}"}, &Row::psnr_db},
       {{"psnr_seen_db", kMoreIsBetter, "seen dB", 9, "{:.2f}"}, &Row::psnr_seen_db},
       {{"ssim", kMoreIsBetter, "SSIM", 7, "{:.3f}"}, &Row::ssim},
       {{"what", kRemark, "", 0, "{}", "-"}, &Row::in_words},
       {{"failed", kFailed}, &Row::failed}},
      rows);
  table.rows_key = "qualities";
  table.starred = "front";
  table.MarkFront("minutes", "choosing_db");
  return table;
}

Plot PictureOf(const TradeoffTable& table) {
  TradeoffPanel panel;
  panel.title = "The whole pipeline";
  panel.subtitle = "left-out photos against minutes";
  panel.x = "minutes";
  panel.x_axis = {"minutes", true};
  panel.y = "choosing_db";  // what is recommended by
  panel.y_axis = {"PSNR of the choosing fold, dB"};
  panel.label = "name";
  panel.series = {{"", "qualities", "#24292f"}};
  panel.front = table.Front("minutes", "choosing_db");
  return PlotOf(table, panel);
}

// OUT holds several scenes: it is none itself, and lies outside of what is read.
void RequireOutput(const PipelineOptions& options) {
  const fs::path& out = options.output;
  if (out.empty()) throw UsageError("-o OUT is missing", "name the folder that a scene for each quality goes to");
  if (IsWithin(out, options.input) || IsWithin(options.input, out))
    throw UsageError(
        fmt::format("the output {} and the input {} lie in each other", out.string(), options.input.string()),
        "choose an output beside it");
  std::error_code error;
  if (fs::exists(out / "lumigraph.json", error))
    throw UsageError(fmt::format("{} is a scene, and --tradeoff makes several", out.string()), "name another folder");
  RequireOurFolder(out, "tradeoff");
}

// Marks OUT as ours while it holds nothing else; gone again where nothing came of it.
class OurOutput {
 public:
  explicit OurOutput(const fs::path& out) : out_(out) {
    std::error_code error;
    fs::create_directories(out_ / "tradeoff", error);
    if (error) throw MachineError(fmt::format("cannot be made: {}", error.message()), "choose another output", out_);
  }
  ~OurOutput() {
    std::error_code ignored;  // what is not empty stays
    if (std::distance(fs::directory_iterator(out_, ignored), fs::directory_iterator()) == 1)
      fs::remove(out_ / "tradeoff", ignored);
    fs::remove(out_, ignored);
  }
  OurOutput(const OurOutput&) = delete;
  OurOutput& operator=(const OurOutput&) = delete;

 private:
  fs::path out_;
};

// The best by the photos that are not reported on, of those that placed the most photos: fewer are easier.
Recommended BestOf(const std::vector<PricedQuality>& rows, std::optional<double> minutes) {
  int most = 0;
  for (const PricedQuality& r : rows) most = std::max(most, r.placed);
  std::vector<CostAndQuality> measured;
  for (const PricedQuality& r : rows) measured.push_back({r.minutes, r.placed == most ? r.choosing_db : kNone});
  if (ParetoFront(measured).empty())
    throw DataError("no quality has photos to leave out: too few have a camera", "take more photos");
  return RecommendedRow(measured, minutes);
}

}  // namespace

PipelinePrice RunPipelinePrice(const PipelineOptions& options, ProgressSink& progress) {
  if (const std::string wrong = Validate(options); !wrong.empty()) throw UsageError(wrong);
  if (options.holdout == 0) throw UsageError("--tradeoff compares left-out photos, and --holdout 0 leaves none out");
  const bool cameras_given = CamerasAreGiven(options);
  RequireOutput(options);
  const OurOutput output(options.output);

  const std::vector<PipelineQuality> qualities = QualitiesFor(options, cameras_given);
  std::vector<PricedQuality> rows;
  std::exception_ptr first_failure;
  for (const PipelineQuality& quality : qualities) {
    PipelineOptions run = WithQuality(options, quality, cameras_given);
    run.minutes.reset();
    run.output = options.output / quality.name;
    PricedQuality row{.quality = quality, .in_words = InWords(quality, options, cameras_given)};
    progress.Message(
        fmt::format("quality {} of {}: {} ({})", rows.size() + 1, qualities.size(), quality.name, row.in_words));
    const auto start = std::chrono::steady_clock::now();
    try {
      TakePrice(RunPipeline(run, progress), row);
      row.choosing_db = ChoosingPsnr(run.output, run, progress);
    } catch (const Error& e) {
      // A fault of the options or of the machine would stop every quality.
      if (e.code() != ExitCode::kDataRefused) throw;
      if (!first_failure) first_failure = std::current_exception();
      row.failed = e.what();
      row.minutes = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() / 60;
    }
    rows.push_back(std::move(row));
    if (options.minutes && rows.back().minutes > *options.minutes) break;
  }
  if (first_failure && std::ranges::all_of(rows, [](const PricedQuality& r) { return !r.failed.empty(); }))
    std::rethrow_exception(first_failure);

  PipelinePrice price{.table = TableOf(rows)};
  const Recommended best = BestOf(rows, options.minutes);
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
  return TextOf(price.table) +
         fmt::format("\n{}: {}\nscene:   {}\npicture: {}",
                     price.fits ? "recommended" : "the cheapest, and it takes longer than was asked", price.recommended,
                     price.scene.string(), price.files.svg.string());
}

}  // namespace lumi
