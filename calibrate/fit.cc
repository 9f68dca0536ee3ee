#include "calibrate/fit.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include "calibrate/choose_model.h"
#include "calibrate/zhang.h"
#include "scene/geometry/angle.h"
#include "scene/geometry/constants.h"
#include "scene/geometry/median.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"

namespace lumi {
namespace {

// Cauchy's scale while nothing is known of the noise, and its least: sub-pixel corners are no better on photographs.
constexpr double kFirstRobustScalePx = 2, kLeastRobustScalePx = 0.02;
constexpr double kCauchyScalePerSigma = 2.4;  // 95 % as efficient as least squares on Gaussian noise
constexpr double kRayleighMedian = 1.1774;    // median distance of a corner over the standard deviation of a coordinate
constexpr double kOutlierViewSpreads = 6;  // a view's RMS above the median's, in standard deviations (from the MAD) ...
constexpr double kOutlierViewRatio = 1.6;  // ... and in medians: beyond both
constexpr double kOutlierViewFloorPx = 0.1;  // no view is refused below
constexpr double kTrimmedShare =
    0.05;  // of a view's corners, the worst, that its RMS does not count: single corners are no view
constexpr double kOutlierCornerSigmas = 8;  // one in 1e14 on Gaussian noise
constexpr double kOutlierCornerFloorPx = 0.05;
constexpr double kLargestOutlierShare = 0.5;  // of the views; beyond, nobody can tell which half is wrong
constexpr double kNoiseFloorPx = 0.05;  // what a photograph's corners have at least: degenerate sets are judged with it
constexpr double kParallelRad = 15 * kRadPerDeg;  // of an undetermined set: boards within this are called parallel
constexpr std::size_t kLeastViews = 3;            // Zhang: five intrinsics, two equations a view
constexpr std::size_t kViewsForFullest = 5;       // of fewer the fullest model would explain outliers too
constexpr int kStartIterations = 60, kQuickIterations = 100;  // at most: to compare starts, to judge
constexpr std::size_t kRefinedStarts = 4;                     // of the starts that are compared
// Focal lengths that starts are tried with, of the longer side: from a fisheye to a long lens, in steps from which the
// refinement finds its way.
constexpr std::array<double, 9> kStartFocals = {0.3, 0.45, 0.65, 0.9, 1.3, 1.9, 2.8, 4.2, 7.0};
constexpr double kNominalFocal = 1.2;  // of the longer side: 45 degrees, an ordinary lens
constexpr double kEdgeOfMiddle = 0.4;  // of the picture: nearer to a side than this a mean is said to lie there
constexpr const char* kMorePhotos = "photograph the whole board from ten places or more, tilted, all over the picture";

std::vector<double> AllErrors(const Board& board, const std::vector<BoardView>& views, const CalibrationStart& at) {
  std::vector<double> all;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const auto errors = CornerErrors(board, views[v], at.intrinsics, at.cam_from_board[v]);
    all.insert(all.end(), errors.begin(), errors.end());
  }
  return all;
}

std::vector<Eigen::Matrix3d> Homographies(const Board& board, const std::vector<BoardView>& views) {
  std::vector<Eigen::Matrix3d> homographies;
  const auto on_board = board.Corners();
  for (const BoardView& view : views) {
    const auto H = PlaneHomography(on_board, view.corners_px);
    if (!H) throw DataError(fmt::format("the corners of {} lie on a line", view.name), "leave that photo out");
    homographies.push_back(*H);
  }
  return homographies;
}

CalibrationStart StartOf(const Calibration& c) { return {c.intrinsics, c.cam_from_board}; }

// The closed form (with and without skew) and a sweep of focal lengths; the most promising are refined, robustly, and
// the one with the smallest median error is taken. The closed form knows no distortion: a wide lens can lead it astray,
// or to no answer.
std::optional<CalibrationStart> FindStart(const Board& board, const std::vector<BoardView>& views,
                                          const std::vector<Eigen::Matrix3d>& homographies, int width_px,
                                          int height_px) {
  std::vector<Intrinsics> candidates;
  for (const bool with_skew : {true, false})
    if (const auto K = ClosedFormCalibration(homographies, with_skew, width_px, height_px)) {
      Intrinsics k = NominalIntrinsics((*K)(0, 0), 0, 0);
      k[kAspect] = (*K)(1, 1) / (*K)(0, 0);
      k[kCx] = (*K)(0, 2);
      k[kCy] = (*K)(1, 2);
      candidates.push_back(k);
    }
  for (const double factor : kStartFocals)
    candidates.push_back(NominalIntrinsics(factor * std::max(width_px, height_px), width_px, height_px));

  std::vector<std::pair<double, CalibrationStart>> ranked;
  for (const Intrinsics& k : candidates) {
    CalibrationStart start{k, {}};
    Eigen::Matrix3d K;
    K << k[kFx], 0, k[kCx], 0, k[kFx] * k[kAspect], k[kCy], 0, 0, 1;
    for (const Eigen::Matrix3d& H : homographies)
      if (const auto pose = PoseFromHomography(K, H); pose && pose->translation.allFinite())
        start.cam_from_board.push_back(*pose);
    if (start.cam_from_board.size() != views.size()) continue;
    const double median = Median(AllErrors(board, views, start));
    if (std::isfinite(median)) ranked.emplace_back(median, std::move(start));
  }
  std::ranges::sort(ranked, [](const auto& a, const auto& b) { return a.first < b.first; });
  if (ranked.size() > kRefinedStarts) ranked.resize(kRefinedStarts);
  std::optional<CalibrationStart> best;
  double best_median = std::numeric_limits<double>::infinity();
  const RefineOptions options{*LensModelFromName(kSimplestUseful), kFirstRobustScalePx, kStartIterations};
  std::vector<std::optional<CalibrationStart>> refined(ranked.size());
  ParallelEach(ranked.size(), 1, [&](std::size_t i) {
    const Calibration c = Refine(board, views, options, Restrict(ranked[i].second, options.model));
    if (c.intrinsics.allFinite() && c.intrinsics[kFx] > 0) refined[i] = StartOf(c);
  });
  for (const auto& start : refined) {
    if (!start) continue;
    const double median = Median(AllErrors(board, views, *start));
    if (median < best_median) best_median = median, best = start;
  }
  return best;
}

// The largest angle between the normals of two boards, with a nominal focal length and the distortion that goes with
// it: frontal boards are frontal with any.
double LargestTilt(const Board& board, const std::vector<BoardView>& views, int width_px, int height_px) {
  CalibrationStart start{NominalIntrinsics(kNominalFocal * std::max(width_px, height_px), width_px, height_px), {}};
  Eigen::Matrix3d K;
  K << start.intrinsics[kFx], 0, width_px / 2.0, 0, start.intrinsics[kFx], height_px / 2.0, 0, 0, 1;
  for (const Eigen::Matrix3d& H : Homographies(board, views)) {
    const auto pose = PoseFromHomography(K, H);
    if (!pose) return 0;
    start.cam_from_board.push_back(*pose);
  }
  LensModel distortion;
  distortion.free[kK1] = distortion.free[kK2] = true;
  const Calibration c = Refine(board, views, {distortion, kFirstRobustScalePx, kStartIterations}, start);
  double largest = 0;
  for (std::size_t i = 0; i < views.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      largest =
          std::max(largest, AngleBetween(c.cam_from_board[i].R().col(2).eval(), c.cam_from_board[j].R().col(2).eval()));
  return largest;
}

[[noreturn]] void ThrowUndetermined(const Board& board, const std::vector<BoardView>& views, int width_px,
                                    int height_px, const std::string& detail) {
  const double tilt = LargestTilt(board, views, width_px, height_px);
  if (tilt < kParallelRad)
    throw DataError(
        fmt::format("all boards are parallel (within {:.1f} degrees): such views leave the focal length open",
                    tilt / kRadPerDeg),
        "tilt the board by 20 to 45 degrees, about both of its axes");
  throw DataError("the views do not determine the focal length: " + detail,
                  "photograph the board closer, tilted by 20 to 45 degrees about both of its axes");
}

double Cross(const Eigen::Vector2d& o, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return (a.x() - o.x()) * (b.y() - o.y()) - (a.y() - o.y()) * (b.x() - o.x());
}

std::string PlaceOf(const std::vector<BoardView>& views, int width_px, int height_px) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  double count = 0;
  for (const auto& view : views)
    for (const auto& c : view.corners_px) mean += c, ++count;
  mean /= count;
  const std::string across = mean.x() < kEdgeOfMiddle * width_px         ? "left"
                             : mean.x() > (1 - kEdgeOfMiddle) * width_px ? "right"
                                                                         : "";
  const std::string down = mean.y() < kEdgeOfMiddle * height_px         ? "upper"
                           : mean.y() > (1 - kEdgeOfMiddle) * height_px ? "lower"
                                                                        : "";
  if (across.empty() && down.empty()) return "around its middle";
  if (!across.empty() && !down.empty()) return "in its " + down + " " + across + " corner";
  return "in its " + down + across + " part";
}

// The view as its photo's mirror image would show it, in an order that runs the right way round.
BoardView Mirrored(const Board& board, const BoardView& view, int width_px) {
  BoardView mirrored = view;
  for (int j = 0; j < board.rows; ++j)
    for (int i = 0; i < board.columns; ++i) {
      const auto& c = view.corners_px[static_cast<std::size_t>(j * board.columns + board.columns - 1 - i)];
      mirrored.corners_px[static_cast<std::size_t>(j * board.columns + i)] = {width_px - c.x(), c.y()};
    }
  return mirrored;
}

double TrimmedRms(std::vector<double> errors) {
  const auto kept = static_cast<std::size_t>(std::floor((1 - kTrimmedShare) * static_cast<double>(errors.size())));
  std::ranges::sort(errors);
  double sum = 0;
  for (std::size_t i = 0; i < kept; ++i) sum += errors[i] * errors[i];
  return std::sqrt(sum / static_cast<double>(kept));
}

// The RMS beyond which a view is an outlier among these.
double OutlierLimit(const std::vector<double>& rms) {
  const double median = Median(rms);
  std::vector<double> deviations;
  for (const double r : rms) deviations.push_back(std::abs(r - median));
  return std::max({median + kOutlierViewSpreads * kSigmaPerMad * Median(deviations), kOutlierViewRatio * median,
                   kOutlierViewFloorPx});
}

struct OutlierFigures {
  double rms, median, limit;  // px
};

std::string OutlierReason(const Board& board, const BoardView& view, const Calibration& c,
                          const OutlierFigures& view_px, int width_px) {
  const auto [rms, median, limit] = view_px;
  const BoardView mirrored = Mirrored(board, view, width_px);
  Eigen::Matrix3d K;
  K << c.intrinsics[kFx], c.intrinsics[kSkew], c.intrinsics[kCx], 0, c.Fy(), c.intrinsics[kCy], 0, 0, 1;
  if (const auto H = PlaneHomography(board.Corners(), mirrored.corners_px))
    if (const auto pose = PoseFromHomography(K, *H)) {
      const double other =
          TrimmedRms(CornerErrors(board, mirrored, c.intrinsics, RefinePose(board, mirrored, c.intrinsics, *pose)));
      if (other <= limit && other < rms)
        return fmt::format("the photo is mirrored: RMS {:.2f} px, turned round {:.2f} px", rms, other);
    }
  return fmt::format(
      "outlier: RMS {:.2f} px, limit {:.2f} px (median of the views {:.2f} px, {:g} standard deviations by MAD above "
      "it)",
      rms, limit, median, kOutlierViewSpreads);
}

// Views that disagree with the others are moved to result.refused, single corners marked; the last robust fit is
// returned.
Calibration RefuseOutliers(const Board& board, CalibrationStart start, int width_px, const LensModel& model,
                           FitResult& result) {
  std::vector<BoardView>& views = result.views;
  const std::size_t total = views.size();
  for (;;) {
    CheckInterrupted();
    start = Restrict(start, model);
    Calibration c = Refine(board, views, {model, kFirstRobustScalePx, kStartIterations}, start);
    const double noise = Median(AllErrors(board, views, StartOf(c))) / kRayleighMedian;
    c = Refine(board, views, {model, std::max(kCauchyScalePerSigma * noise, kLeastRobustScalePx), kQuickIterations},
               StartOf(c));
    std::vector<double> rms;
    for (std::size_t v = 0; v < views.size(); ++v)
      rms.push_back(TrimmedRms(CornerErrors(board, views[v], c.intrinsics, c.cam_from_board[v])));
    const double median = Median(rms), limit = OutlierLimit(rms);
    std::vector<BoardView> kept;
    CalibrationStart kept_start{c.intrinsics, {}};
    std::vector<RefusedView> refused;
    for (std::size_t v = 0; v < views.size(); ++v) {
      if (rms[v] <= limit) {
        kept.push_back(views[v]);
        kept_start.cam_from_board.push_back(c.cam_from_board[v]);
      } else {
        refused.push_back({views[v].name, OutlierReason(board, views[v], c, {rms[v], median, limit}, width_px)});
      }
    }
    if (refused.empty()) {
      const double sigma = Median(AllErrors(board, views, StartOf(c))) / kRayleighMedian;
      for (std::size_t v = 0; v < views.size(); ++v) {
        const auto errors = CornerErrors(board, views[v], c.intrinsics, c.cam_from_board[v]);
        views[v].left_out.assign(errors.size(), false);
        for (std::size_t i = 0; i < errors.size(); ++i)
          if (errors[i] > std::max(kOutlierCornerSigmas * sigma, kOutlierCornerFloorPx))
            views[v].left_out[i] = true, ++result.corners_left_out;
      }
      return c;
    }
    result.refused.insert(result.refused.end(), refused.begin(), refused.end());
    if (static_cast<double>(kept.size()) < (1 - kLargestOutlierShare) * static_cast<double>(total) ||
        kept.size() < kLeastViews)
      throw DataError(fmt::format("the views contradict one another: {} of {} do not fit ({}: {})",
                                  result.refused.size(), total, result.refused[0].name, result.refused[0].reason),
                      "take all photos with one camera, focus and zoom fixed, and a board that is flat");
    views = std::move(kept);
    start = std::move(kept_start);
  }
}

// The views whose corners run the wrong way round are taken out; the homographies of the others.
std::vector<Eigen::Matrix3d> RefuseMirrored(const Board& board, std::vector<BoardView>& views, FitResult& result) {
  std::vector<Eigen::Matrix3d> homographies = Homographies(board, views);
  const auto wrong_way = std::ranges::count_if(homographies, [](const auto& H) { return H.determinant() < 0; });
  if (2 * static_cast<std::size_t>(wrong_way) >= views.size())
    throw DataError(fmt::format("the board is mirrored: its corners run the wrong way round in {} of {} views",
                                wrong_way, views.size()),
                    "turn mirrored photos round, or give columns and rows in the board's own order");
  for (std::size_t v = views.size(); v-- > 0;)
    if (homographies[v].determinant() < 0) {
      result.refused.push_back({views[v].name, "mirrored: its corners run the wrong way round"});
      views.erase(views.begin() + static_cast<std::ptrdiff_t>(v));
      homographies.erase(homographies.begin() + static_cast<std::ptrdiff_t>(v));
    }
  if (views.size() < kLeastViews)
    throw DataError("fewer than three views are left without the mirrored ones", kMorePhotos);
  return homographies;
}

}  // namespace

std::string FitOptions::Problem() const {
  if (!model.empty() && !LensModelFromName(model)) {
    std::string names = "thesis";
    for (const LensModel& m : LensModels()) names += ", " + m.name;
    return fmt::format("there is no model \"{}\": {}", model, names);
  }
  if (!model.empty() && fix_aspect && !LensModelFromName(model)->name.starts_with("square"))
    return fmt::format("the model \"{}\" frees the aspect that --fix-aspect holds", model);
  if (folds < 2) return "the cross-validation needs two folds at least";
  if (!(min_coverage >= 0 && min_coverage <= 1)) return "the coverage asked for is no share between 0 and 1";
  if (!(max_focal_sigma > 0)) return "the largest standard deviation of the focal length has to be above 0";
  return {};
}

double Coverage(const std::vector<BoardView>& views, int width_px, int height_px) {
  std::vector<Eigen::Vector2d> points;
  for (const BoardView& view : views) points.insert(points.end(), view.corners_px.begin(), view.corners_px.end());
  std::ranges::sort(points,
                    [](const auto& a, const auto& b) { return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y()); });
  if (points.size() < 3) return 0;
  std::vector<Eigen::Vector2d> hull;  // Andrew's monotone chain
  for (int pass = 0; pass < 2; ++pass) {
    const std::size_t base = hull.size();
    for (const auto& p : points) {
      while (hull.size() >= base + 2 && Cross(hull[hull.size() - 2], hull.back(), p) <= 0) hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();
    std::ranges::reverse(points);
  }
  double area = 0;
  for (std::size_t i = 0; i + 1 < hull.size(); ++i) area += Cross(hull[0], hull[i], hull[i + 1]) / 2;
  return area / (static_cast<double>(width_px) * height_px);
}

std::vector<double> HeldOutSquares(const Board& board, const std::vector<BoardView>& views,
                                   const Intrinsics& intrinsics, const std::vector<Rigid3>& start) {
  std::vector<double> squares;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const auto errors = CornerErrors(board, views[v], intrinsics, RefinePose(board, views[v], intrinsics, start[v]));
    double sum = 0;
    for (std::size_t i = 0; i < errors.size(); ++i)
      if (views[v].Used(i)) sum += errors[i] * errors[i];
    squares.push_back(sum);
  }
  return squares;
}

FitResult Fit(const Board& board, std::vector<BoardView> views, int width_px, int height_px,
              const FitOptions& options) {
  if (const std::string problem = options.Problem(); !problem.empty()) throw UsageError(problem);
  if (views.empty()) throw DataError("no board was found", kMorePhotos);
  if (views.size() < kLeastViews)
    throw DataError(
        views.size() == 1
            ? "the board was found in one view only: one plane leaves the focal length and the principal point open"
            : "the board was found in two views only, at least three are needed",
        kMorePhotos);
  FitResult result;
  const std::vector<Eigen::Matrix3d> homographies = RefuseMirrored(board, views, result);
  result.coverage = Coverage(views, width_px, height_px);
  if (result.coverage < options.min_coverage)
    throw DataError(
        fmt::format("the boards cover {:.0f} % of the picture, all {}: nothing would be known of the rest",
                    100 * result.coverage, PlaceOf(views, width_px, height_px)),
        fmt::format("move the board through all of the picture, corners included ({:.0f} % at least, --min-coverage)",
                    100 * options.min_coverage));

  auto start = FindStart(board, views, homographies, width_px, height_px);
  if (!start) ThrowUndetermined(board, views, width_px, height_px, "none explains them");
  const std::optional<LensModel> given = options.model.empty() ? std::nullopt : LensModelFromName(options.model);
  const LensModel simple = *LensModelFromName(kSimplestUseful);
  result.views = std::move(views);

  // Judged by the model with the fewest useful terms: data that leave these undetermined determine no other model.
  const auto judge = [&](const Calibration& c) {
    const double relative = c.Sigma(kFx, std::max(c.noise_px, kNoiseFloorPx)) / c.intrinsics[kFx];
    if (c.usable && relative <= options.max_focal_sigma) return;
    ThrowUndetermined(board, result.views, width_px, height_px,
                      c.usable ? fmt::format("its standard deviation would be {:.1f} %", 100 * relative) : c.why);
  };
  // Parallel boards are detected before outliers: with the focal length undetermined, any view can be made an outlier.
  judge(Refine(board, result.views, {simple, kFirstRobustScalePx, kQuickIterations}, Restrict(*start, simple)));

  // With few views the fullest model would fit outliers, too.
  const LensModel rich = result.views.size() < kViewsForFullest ? simple : FullestModel(options.fix_aspect);
  const Calibration robust = options.keep_outliers
                                 ? Refine(board, result.views, {rich, 0, kFullIterations}, Restrict(*start, rich))
                                 : RefuseOutliers(board, *start, width_px, rich, result);
  result.coverage = Coverage(result.views, width_px, height_px);
  judge(Refine(board, result.views, {simple, 0, kQuickIterations}, Restrict(StartOf(robust), simple)));

  const std::vector<LensModel> models = given ? std::vector<LensModel>{*given} : LensModels(options.fix_aspect);
  const std::vector<HeldOutFit> fits = FitModels(board, result.views, models, StartOf(robust), options.folds);
  const ModelChoice choice = given ? ModelChoice{0, "as asked", {}, {}} : ChooseModel(models, fits);
  for (std::size_t m = 0; m < models.size(); ++m)
    result.trials.push_back({models[m], fits[m].all.rms_px, fits[m].rms_px, fits[m].why_not, fits[m].seconds,
                             fits[m].all.intrinsics[kFx], fits[m].all.Sigma(kFx, fits[m].all.noise_px),
                             !choice.as_good.empty() && choice.as_good[m] != 0});
  result.choice = choice.why;
  result.model_spread_px = choice.spread_px;
  result.calibration = fits[choice.model].all;
  result.cross_validated_rms_px = fits[choice.model].rms_px;
  judge(result.calibration);
  return result;
}

std::vector<ViewCountTrial> ViewCountTradeoff(const Board& board, const FitResult& fit, std::uint64_t seed) {
  constexpr int kSubsets = 12;
  const std::size_t total = fit.views.size();
  const Calibration& all = fit.calibration;
  std::vector<std::size_t> sizes;
  for (double n = kLeastViews; n + 1 < static_cast<double>(total); n = std::max(n + 1, std::round(1.35 * n)))
    sizes.push_back(static_cast<std::size_t>(n));
  std::vector<ViewCountTrial> trials;
  for (const std::size_t n : sizes) {
    struct Outcome {
      bool usable = false;
      double squares = 0, corners = 0, f = 0, sigma = 0, seconds = 0;
    };
    std::vector<Outcome> outcomes(kSubsets);
    ParallelEach(outcomes.size(), 1, [&](std::size_t s) {
      std::mt19937_64 random(seed * 1000003 + n * 1009 + s);
      std::vector<std::size_t> order(total);
      std::iota(order.begin(), order.end(), std::size_t{0});
      for (std::size_t i = total - 1; i > 0; --i) std::swap(order[i], order[random() % (i + 1)]);
      std::vector<BoardView> in, out;
      std::vector<Rigid3> in_poses, out_poses;
      for (std::size_t i = 0; i < total; ++i) {
        (i < n ? in : out).push_back(fit.views[order[i]]);
        (i < n ? in_poses : out_poses).push_back(all.cam_from_board[order[i]]);
      }
      const Calibration c = Refine(board, in, {all.model, 0, kFullIterations}, {all.intrinsics, in_poses});
      if (!c.usable) return;
      const auto squares = HeldOutSquares(board, out, c.intrinsics, out_poses);
      outcomes[s] = {true,
                     std::accumulate(squares.begin(), squares.end(), 0.0),
                     static_cast<double>(UsedCorners(out)),
                     c.intrinsics[kFx],
                     c.Sigma(kFx, c.noise_px),
                     c.seconds};
    });
    ViewCountTrial trial{static_cast<int>(n), 0, 0, 0, 0, 0};
    double squares = 0, corners = 0, f2 = 0;
    for (const Outcome& o : outcomes) {
      if (!o.usable) continue;
      ++trial.subsets;
      squares += o.squares, corners += o.corners;
      f2 += std::pow(o.f - all.intrinsics[kFx], 2);
      trial.sigma_f_percent += 100 * o.sigma / o.f;
      trial.seconds += o.seconds;
    }
    if (trial.subsets == 0) continue;
    const double m = trial.subsets;
    trial.held_out_rms_px = std::sqrt(squares / corners);
    trial.sigma_f_percent /= m;
    trial.seconds /= m;
    trial.spread_f_percent = 100 * std::sqrt(f2 / m) / all.intrinsics[kFx];
    trials.push_back(trial);
  }
  trials.push_back({static_cast<int>(total), fit.cross_validated_rms_px.value_or(all.rms_px),
                    100 * all.Sigma(kFx, all.noise_px) / all.intrinsics[kFx], 0, all.seconds, 1});
  return trials;
}

}  // namespace lumi
