#include "stabilize/stabilize.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "scene/geometry/constants.h"
#include "scene/geometry/median.h"
#include "scene/program/error.h"
#include "stabilize/jitter.h"
#include "stabilize/path_before.h"
#include "stabilize/path_problem.h"
#include "stabilize/view_area.h"
#include "stabilize/world_map.h"

namespace lumi {
namespace {

// A path is least certain at its ends, where no frames beyond hold it. There pictures are held more strongly to be
// similarities of the filmed ones: the weight is multiplied by up to 1 + kAlikeAtEnds.
constexpr double kAlikeAtEnds = 30, kEnd_s = 0.1;
constexpr double kBorderShare = 0.5;   // of a border point, whose depth is extended, against one of the structure
constexpr double kScaleSlack = 0.002;  // of min_scale: half a pixel of 500
constexpr double kSpread_s = 0.35;  // seconds around a frame that has to follow the camera, so that it does so gently
constexpr double kGain = 40;        // log of the weight, a unit of scale that is missing ...
constexpr double kMostMissing =
    0.04;  // ... at most so much in a round (five times the weight, half as much again for the cutoff) ...
constexpr double kMuchMissing = 0.1;   // ... unless a tenth is missing: then so much
constexpr double kGuessedShare = 0.1;  // of a border point there: each scene extends its own depths
constexpr double kSeamCutoff_hz =
    3;  // what leads from the path before to this one is slower: faster is how unsure the two are of it
constexpr double kMostStep = 0.5;    // units that an image may move from one frame to the next ...
constexpr double kNextFrames = 1.5;  // ... where none is missing between them
constexpr int kMostAnchors = 250;    // of a frame: dense, so that another window's points are among them

// A frame's points that its matrix is fitted to: its structure, spread over the picture, and its border.
std::vector<WantedPoint> PointsOf(const FilmedScene& film, const FilmedFrame& frame, int wanted) {
  constexpr int kColumns = 8, kRows = 6;
  std::array<std::vector<const SightOfPoint*>, kColumns * kRows> cells;
  const Eigen::Vector2d half = film.half();
  for (const SightOfPoint& s : frame.sights) {
    const int c = std::clamp(static_cast<int>(kColumns * (s.x.x() / half.x() + 1) / 2), 0, kColumns - 1);
    const int r = std::clamp(static_cast<int>(kRows * (s.x.y() / half.y() + 1) / 2), 0, kRows - 1);
    cells[static_cast<std::size_t>(r * kColumns + c)].push_back(&s);
  }
  std::vector<WantedPoint> points;
  for (std::size_t depth = 0; points.size() < static_cast<std::size_t>(wanted); ++depth) {
    bool any = false;
    for (const auto& cell : cells) {
      if (depth >= cell.size() || points.size() >= static_cast<std::size_t>(wanted)) continue;
      any = true;
      points.push_back({film.X[static_cast<std::size_t>(cell[depth]->point)], Eigen::Vector2d::Zero(), 1});
    }
    if (!any) break;
  }
  for (const Eigen::Vector4d& X : frame.border) points.push_back({X, Eigen::Vector2d::Zero(), kBorderShare});
  // At one centre a point is a direction: whatever moved along it, the camera would leave the centre for no reason.
  if (film.one_centre) {
    const Eigen::Vector4d centre = CentreOfProjection(frame.P);
    for (WantedPoint& point : points) point.X -= centre * centre.dot(point.X);
  }
  return points;
}

// Another depth on the ray of each point, far ones' near, near ones' far. A floor before a wall has one depth in each
// direction, so a camera that wanders along its view while zooming back shows the points almost where they were, and
// its pictures would be made of photos from elsewhere. Keeping the two points of a ray behind each other fixes the
// centre.
void AddDepths(const FilmedScene& film, const FilmedFrame& frame, std::vector<WantedPoint>& points) {
  const Eigen::Vector4d centre = CentreOfProjection(frame.P);
  const double towards = film.plane_at_infinity.dot(centre);
  if (film.one_centre || points.empty() || std::abs(towards) < 1e-9) return;
  std::vector<double> kappa;
  for (const WantedPoint& point : points)
    kappa.push_back(film.plane_at_infinity.dot(point.X) / frame.P.row(2).dot(point.X));
  std::vector<double> sorted = kappa;
  std::ranges::sort(sorted);
  const double far = sorted[sorted.size() / 10], near = sorted[sorted.size() - 1 - sorted.size() / 10];
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double other = kappa[i] < 0.5 * (far + near) ? near : far;
    points[i].Z = (points[i].X + (other - kappa[i]) * frame.P.row(2).dot(points[i].X) / towards * centre).normalized();
  }
}

// What the camera of the film does from one frame to the next, W - I with A_(t+1) = A_t W, A = [P; pi], without its
// shake: the mean over a Hann window of the seconds given. A camera that turns or walks steadily has a constant W in an
// affine frame, and W is of the world, so that means of it are too. Zero where nothing is known.
std::vector<Eigen::Matrix4d> SteadyMotion(const FilmedScene& film, const std::vector<double>& times, double window_s) {
  const auto n = static_cast<int>(film.frames.size());
  const Eigen::Vector4d last = film.one_centre ? CentreOfProjection(film.frames.front().P) : film.plane_at_infinity;
  std::vector<Eigen::Matrix4d> A(film.frames.size());
  std::vector<double> det(film.frames.size());
  for (std::size_t t = 0; t < film.frames.size(); ++t) {
    A[t] << film.frames[t].P, last.transpose();
    det[t] = A[t].determinant();
    A[t].topRows<3>() /= std::cbrt(std::max(std::abs(det[t]), 1e-300));
  }
  std::vector<Eigen::Matrix4d> step(film.frames.size(), Eigen::Matrix4d::Zero()), mean = step;
  std::vector<char> known(film.frames.size(), 0);
  for (std::size_t t = 0; t + 1 < film.frames.size(); ++t) {
    if (!(std::abs(det[t]) > 1e-12) || (det[t] < 0) != (det[t + 1] < 0)) continue;  // a centre crosses the plane
    step[t] = (A[t].inverse() * A[t + 1] - Eigen::Matrix4d::Identity()) / (times[t + 1] - times[t]);
    known[t] = step[t].allFinite() && step[t].norm() < 1;
  }
  const int reach = std::max(1, static_cast<int>(std::lround(0.5 * window_s * film.fps)));
  for (int t = 0; t < n; ++t) {
    double weights = 0;
    const auto add = [&](int k) {  // false: beyond the window
      const auto at = static_cast<std::size_t>(k);
      const double u = (0.5 * (times[at] + times[at + 1]) - times[static_cast<std::size_t>(t)]) / (reach + 0.5);
      if (std::abs(u) >= 1) return false;
      if (!known[at]) return true;
      const double w = (0.5 + 0.5 * std::cos(std::numbers::pi * u)) * (times[at + 1] - times[at]);
      mean[static_cast<std::size_t>(t)] += w * step[at];
      weights += w;
      return true;
    };
    for (int k = t - 1; k >= 0 && add(k);) --k;
    for (int k = t; k + 1 < n && add(k);) ++k;
    if (weights > 0) mean[static_cast<std::size_t>(t)] /= weights;
  }
  return mean;
}

// The points that the frame sees and `px` puts into the box, without those that show beside the object and lie behind
// it: points nearer than most are taken as the object's.
template <typename Place>
std::vector<std::int32_t> NearestIn(const FilmedScene& film, const FilmedFrame& frame,
                                    const std::vector<double>& box_px, const Place& px) {
  const Eigen::Vector2d low(box_px[0], box_px[1]), high = low + Eigen::Vector2d(box_px[2], box_px[3]);
  std::vector<std::int32_t> all, inside;
  std::vector<double> depth;
  for (const SightOfPoint& s : frame.sights) {
    const std::optional<Eigen::Vector2d> x = px(s);
    if (!x || (x->array() < low.array()).any() || (x->array() > high.array()).any()) continue;
    all.push_back(s.point);
    const Eigen::Vector4d& X = film.X[static_cast<std::size_t>(s.point)];
    depth.push_back(film.plane_at_infinity.dot(X) / frame.P.row(2).dot(X));
  }
  if (all.empty()) return inside;
  std::vector<double> sorted = depth;
  std::ranges::sort(sorted);
  const double near = sorted[sorted.size() - 1 - sorted.size() / 10];
  constexpr double kSameDepth = 0.25;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (depth[i] > (1 - kSameDepth) * near) inside.push_back(all[i]);
  return inside;
}

// Around where the points are put at that frame; empty without any.
std::vector<double> BoxOf(const FilmedScene& film, const std::vector<std::int32_t>& points, const Matrix34d& P) {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(1e9), high = -low;
  for (const std::int32_t j : points)
    if (const auto x = ImageOf(P, film.X[static_cast<std::size_t>(j)]))
      low = low.cwiseMin(*x), high = high.cwiseMax(*x);
  if (!(low.array() <= high.array()).all()) return {};
  low = low * film.px_per_unit() + 0.5 * film.size_px.cast<double>(),
  high = high * film.px_per_unit() + 0.5 * film.size_px.cast<double>();
  constexpr double kMarginPx = 2;
  return {low.x() - kMarginPx, low.y() - kMarginPx, high.x() - low.x() + 2 * kMarginPx,
          high.y() - low.y() + 2 * kMarginPx};
}

std::vector<std::int32_t> ObjectPoints(const FilmedScene& film, const StabilizeOptions& options) {
  std::vector<std::int32_t> inside;
  if (options.object_frame < 0 || options.object_frame >= static_cast<int>(film.frames.size()))
    throw UsageError(fmt::format("--object-frame is 0 to {}", film.frames.size() - 1),
                     "the frame that --object speaks of, in the order of time");
  const FilmedFrame& frame = film.frames[static_cast<std::size_t>(options.object_frame)];
  const auto px = [&](const SightOfPoint& s) {
    return Eigen::Vector2d(s.x * film.px_per_unit() + 0.5 * film.size_px.cast<double>());
  };
  if (!options.object_points_px.empty()) {
    for (const Eigen::Vector2d& picked : options.object_points_px) {
      constexpr double kReachPx = 12;
      const SightOfPoint* nearest = nullptr;
      for (const SightOfPoint& s : frame.sights)
        if (!nearest || (px(s) - picked).squaredNorm() < (px(*nearest) - picked).squaredNorm()) nearest = &s;
      if (!nearest || (px(*nearest) - picked).norm() > kReachPx)
        throw DataError(fmt::format("no track passes within {:.0f} px of {:.0f},{:.0f} in frame {}", kReachPx,
                                    picked.x(), picked.y(), options.object_frame),
                        "pick a corner or a texture");
      inside.push_back(nearest->point);
    }
    return inside;
  }
  if (options.object_px.size() != 4)
    throw UsageError("--model vertigo wants the object that is to stay",
                     "--object X,Y,WIDTH,HEIGHT in pixels of the first frame, or --object-point");
  return NearestIn(film, frame, options.object_px, [&](const SightOfPoint& s) { return std::optional(px(s)); });
}

// One path: what the film does, what is wanted of it, and rounds of fitting matrices to that.
class PathMaker {
 public:
  PathMaker(const FilmedScene& film, const StabilizeOptions& options, StabilizeReport& report)
      : film_(film),
        o_(options),
        report_(report),
        n_(film.frames.size()),
        smooth_(options.model == MotionModel::kSmooth) {
    report.model = options.model;
    report.frames = static_cast<int>(n_);
    report.points = static_cast<int>(film.X.size());
    report.homographies = film.one_centre;
    for (const FilmedFrame& frame : film.frames) original_.push_back(frame.P);
    FindShown();
    if (!smooth_) FitMotion();
    ChoosePoints();
    problem_.smoothness = SmoothnessOf(o_.cutoff_hz, film.fps);
    problem_.times = film.TimesInFrames();
    // The last frames, which the next window has too: this path's share rises over its own first seam, and the next
    // window's rises over the seam at this one's end.
    anchors_ = std::min(o_.anchors, static_cast<int>(n_));
    last_seam_ = SeamOf(anchors_, o_.half_window);
    report.first_shown = seam_.begin;
    report.last_shown = static_cast<int>(n_) - 1 - (anchors_ - last_seam_.begin);
    if (smooth_) steady_ = SteadyMotion(film, problem_.times, 1 / o_.cutoff_hz);
    P_ = smooth_ ? original_ : model_.P;
    follow_.assign(n_, smooth_ ? 1.0 : 0.0);
    log_follow_.assign(n_, 0.0);
  }

  MatrixPath Make(ProgressSink& progress) {
    const PathBefore earlier(film_, shown_, points_);
    std::vector<Matrix34d> led;
    Progress steps(progress, "path", o_.iterations + 1);
    for (int round = 0;; ++round) {
      Solve();
      led = P_;
      if (overlap_ > 0) LeadOver(earlier, led);
      steps.Step();
      scales_ = ViewScales(film_, led, {o_.half_window, 0.2});
      if (round >= o_.iterations || !PullTowardsCamera()) break;
    }
    P_ = std::move(led);
    for (std::size_t t = 0; t < n_; ++t) report_.followed_frames += log_follow_[t] > std::log(2.0) ? 1 : 0;
    report_.view_scale = 1;
    for (int t = std::max(0, report_.first_shown); t <= report_.last_shown; ++t)
      report_.view_scale = std::min(report_.view_scale, scales_[static_cast<std::size_t>(t)]);
    report_.shake_before_px = ShakePx(film_, original_);
    report_.shake_after_px = ShakePx(film_, P_);
    return Path();
  }

 private:
  // Where the path before this one put the frames that both have.
  void FindShown() {
    shown_.assign(n_, nullptr);
    if (o_.before) {
      std::map<std::string, const MatrixKey*> by_name;
      for (const MatrixKey& key : o_.before->keys)
        if (!key.anchors.empty()) by_name[key.view] = &key;
      for (std::size_t t = 0; t < n_; ++t)
        if (const auto it = by_name.find(film_.frames[t].name); it != by_name.end()) {
          shown_[t] = it->second;
          overlap_ = static_cast<int>(t) + 1;
        }
      if (overlap_ == 0)
        throw DataError("the path to go on from has anchors for none of the scene's frames",
                        "make it with --anchors N, N the frames that both have");
      report_.joined_frames = overlap_;
    }
    seam_ = SeamOf(overlap_, o_.half_window);
  }

  void FitMotion() {
    if (o_.model == MotionModel::kVertigo) {
      // An object that the earlier path kept in place stays where that path put it.
      const auto seam = static_cast<std::size_t>(seam_.begin);
      if (overlap_ > 0 && shown_[seam] && !o_.before->object_px.empty())
        fit_.object = NearestIn(film_, film_.frames[seam], o_.before->object_px,
                                [&](const SightOfPoint& s) -> std::optional<Eigen::Vector2d> {
                                  const auto to = Moved(shown_[seam]->anchors, Pixel(s.x));
                                  return to ? std::optional(to->to_px) : std::nullopt;
                                });
      else
        fit_.object = ObjectPoints(film_, o_);
    }
    model_ = FitModel(film_, o_.model, fit_);
    report_.model_rms_px = model_.rms * film_.px_per_unit();
    report_.turn_deg = model_.turn_rad * kDegPerRad;
    if (model_.focus_of_expansion) {
      Eigen::Vector3d e = *model_.focus_of_expansion;
      e.head<2>() = film_.px_per_unit() * e.head<2>() + 0.5 * e.z() * film_.size_px.cast<double>();
      report_.focus_of_expansion_px = e;
    }
  }

  void ChoosePoints() {
    points_.resize(n_);
    for (std::size_t t = 0; t < n_; ++t) {
      points_[t] = PointsOf(film_, film_.frames[t], o_.points);
      // A depth that is wrong, or extended to where nothing is, may lie at the next frame's principal plane: one such
      // image outweighs all others.
      std::erase_if(points_[t], [&](const WantedPoint& point) {
        const auto here = ImageOf(original_[t], point.X);
        for (const std::size_t s : {t - 1, t + 1}) {
          if (s >= n_ || std::abs(film_.frames[s].time_s - film_.frames[t].time_s) * film_.fps > kNextFrames) continue;
          const auto there = ImageOf(original_[s], point.X);
          if (!here || !there || (*there - *here).norm() > kMostStep) return true;
        }
        return false;
      });
      AddDepths(film_, film_.frames[t], points_[t]);
    }
  }

  Eigen::Vector2d Pixel(const Eigen::Vector2d& x) const {
    return x * film_.px_per_unit() + 0.5 * film_.size_px.cast<double>();
  }

  // What the path of a point's images bends at frame t, from images at the frames before and after it; 0 where one is
  // behind.
  Eigen::Vector2d Bend(std::size_t t, const std::optional<Eigen::Vector2d>& a, const std::optional<Eigen::Vector2d>& b,
                       const std::optional<Eigen::Vector2d>& c) const {
    const auto [before, at, after] = SecondDifference(problem_.times, t);
    return a && b && c ? Eigen::Vector2d(before * *a + at * *b + after * *c) : Eigen::Vector2d::Zero();
  }
  Eigen::Vector2d WantedBend(std::size_t t, const Eigen::Vector4d& X, const Eigen::Vector2d& meant) const {
    if (t == 0 || t + 1 >= n_) return Eigen::Vector2d::Zero();
    if (!smooth_) return Bend(t, ImageOf(model_.P[t - 1], X), meant, ImageOf(model_.P[t + 1], X));
    // A steady turn bends the images of all points, in the same way everywhere in the picture: that is no shake.
    const Eigen::Matrix4d& W = steady_[t];
    const double to = problem_.times[t + 1] - problem_.times[t], from = problem_.times[t - 1] - problem_.times[t];
    const Eigen::Vector4d first = W * X, second = 0.5 * W * first;
    return Bend(t, ImageOf(P_[t], X + from * first + from * from * second), ImageOf(P_[t], X),
                ImageOf(P_[t], X + to * first + to * to * second));
  }

  // 1 at the film's ends, falling to 0 within kEnd_s.
  double NearEnd(std::size_t t) const {
    const double frames =
        std::min(problem_.times[t] - problem_.times.front(), problem_.times.back() - problem_.times[t]);
    return std::max(0.0, 1 - frames / film_.fps / kEnd_s);
  }

  WantedFrame Wanted(std::size_t t) const {
    WantedFrame frame;
    const double of_model = smooth_ ? 0 : 1;
    const double lasts = TimeStoodFor(problem_.times, t);
    frame.weight = lasts * (of_model + follow_[t]);
    if (smooth_) {  // a model's path has its own centres, and its own pictures
      frame.parallax = lasts * follow_[t];
      frame.alike = lasts * problem_.smoothness / SmoothnessOf(std::max(o_.cutoff_hz, o_.similar_hz), film_.fps) *
                    (1 + kAlikeAtEnds * NearEnd(t) * NearEnd(t));
    }
    for (WantedPoint point : points_[t]) {
      const auto filmed = ImageOf(original_[t], point.X);
      const auto meant = smooth_ ? filmed : ImageOf(model_.P[t], point.X);
      if (!filmed || !meant) continue;
      point.filmed = *filmed;
      point.y = (of_model * *meant + follow_[t] * *filmed) / (of_model + follow_[t]);
      frame.bend.push_back(WantedBend(t, point.X, *meant));
      frame.points.push_back(point);
    }
    return frame;
  }

  void Solve() {
    if (!smooth_ && std::ranges::all_of(follow_, [](double f) { return f == 0; })) return;  // the model's path itself
    std::vector<WantedFrame> wanted;
    for (std::size_t t = 0; t < n_; ++t) wanted.push_back(Wanted(t));
    report_.iterations += SolvePathProblem(wanted, problem_, P_).iterations;
    StripCentre(P_);
  }

  void StripCentre(std::vector<Matrix34d>& matrices) const {
    if (!film_.one_centre) return;
    // At one centre no point determines the matrices along it: what the solver's damping moved there means nothing.
    const Eigen::Vector4d centre = CentreOfProjection(original_.front());
    for (Matrix34d& p : matrices) p -= (p * centre) * centre.transpose();
  }

  // P, with a transition from the path before: matrices whose images first lie where that path put the frame's pixels,
  // and then move to P's own images. The transition is slow; P's own bends stay.
  void LeadOver(const PathBefore& earlier, std::vector<Matrix34d>& P) const {
    const std::size_t n =
        std::min(n_, static_cast<std::size_t>(seam_.end) + 2);  // two of its own, held: what leads over ends smoothly
    std::vector<WantedFrame> wanted(n);
    PathProblemOptions problem;
    problem.smoothness = SmoothnessOf(kSeamCutoff_hz, film_.fps);
    problem.times.assign(problem_.times.begin(), problem_.times.begin() + static_cast<std::ptrdiff_t>(n));
    for (std::size_t t = 0; t < n; ++t) {
      WantedFrame& frame = wanted[t];
      const double share = SeamShare(problem_.times, t, seam_);
      frame.held = share >= 1;
      frame.weight = share >= 1 || shown_[t] ? TimeStoodFor(problem_.times, t) : 0;
      for (WantedPoint point : points_[t]) {
        const auto filmed = ImageOf(original_[t], point.X), own = ImageOf(P[t], point.X);
        if (!filmed || !own) continue;
        point.y = *own;
        if (share < 1 && shown_[t]) {
          const auto to = earlier.Of(t, point.X, Pixel(*filmed));
          if (!to) continue;
          point.y = share * *own + (1 - share) * (to->to_px - Pixel(Eigen::Vector2d::Zero())) / film_.px_per_unit();
          point.share *= point.share < 1 ? kGuessedShare : to->sureness;
        }
        const bool inner = t > 0 && t + 1 < n;
        frame.bend.push_back(inner ? Bend(t, ImageOf(P[t - 1], point.X), own, ImageOf(P[t + 1], point.X))
                                   : Eigen::Vector2d::Zero().eval());
        frame.points.push_back(point);
      }
    }
    std::vector<Matrix34d> led(P.begin(), P.begin() + static_cast<std::ptrdiff_t>(n));
    SolvePathProblem(wanted, problem, led);
    std::ranges::copy(led, P.begin());
    StripCentre(P);
  }

  // Frames that miss something pull the path towards the camera, their neighbours with them. Whether any does.
  bool PullTowardsCamera() {
    std::vector<double> more(n_, 0.0);
    bool any = false;
    const double reach = std::max(1.0, std::ceil(2 * kSpread_s * film_.fps));
    for (std::size_t t = 0; t < n_; ++t) {
      const double missing = o_.min_scale - scales_[t];
      const bool own = static_cast<int>(t) >= report_.first_shown &&
                       static_cast<int>(t) < static_cast<int>(n_) - (anchors_ - last_seam_.end);
      if (missing <= kScaleSlack || !own) continue;
      any = true;
      const double asked = missing > kMuchMissing ? kMuchMissing : std::min(missing, kMostMissing);
      const auto spread = [&](std::size_t at) {  // false: beyond its reach
        const double d = problem_.times[at] - problem_.times[t], u = d / (kSpread_s * film_.fps);
        if (std::abs(d) > reach) return false;
        more[at] = std::max(more[at], asked * std::exp(-0.5 * u * u));
        return true;
      };
      for (std::size_t at = t; spread(at) && at > 0;) --at;
      for (std::size_t at = t; at < n_ && spread(at);) ++at;
    }
    for (std::size_t t = 0; any && t < n_; ++t) {
      log_follow_[t] += kGain * more[t];
      follow_[t] = smooth_ ? std::exp(log_follow_[t]) : std::expm1(log_follow_[t]);
    }
    return any;
  }

  MatrixPath Path() const {
    MatrixPath path;
    path.fps = film_.fps;
    path.width_px = film_.size_px.x();
    path.height_px = film_.size_px.y();
    path.model = Name(o_.model);
    path.view_scale = report_.view_scale;
    path.cropped = o_.crop;
    if (o_.model == MotionModel::kVertigo && anchors_ > 0)
      path.object_px = BoxOf(film_, fit_.object, P_[n_ - static_cast<std::size_t>(anchors_ - last_seam_.begin)]);
    for (std::size_t t = 0; t < n_; ++t) {
      MatrixKey key;
      key.time_s = film_.frames[t].time_s;
      key.view = film_.frames[t].name;
      key.view_scale = scales_[t];
      key.P = film_.InPixels(o_.crop ? CroppedTo(P_[t], report_.view_scale) : P_[t]);
      if (t + static_cast<std::size_t>(anchors_) >= n_)
        for (const WantedPoint& point : PointsOf(film_, film_.frames[t], kMostAnchors)) {
          const auto from = ImageOf(original_[t], point.X), to = ImageOf(P_[t], point.X);
          if (from && to) key.anchors.push_back({Pixel(*from), Pixel(*to)});
        }
      if (!key.anchors.empty() && !film_.one_centre) key.filmed = original_[t], key.steady = P_[t];
      path.keys.push_back(std::move(key));
    }
    return path;
  }

  const FilmedScene& film_;
  const StabilizeOptions& o_;
  StabilizeReport& report_;
  const std::size_t n_;
  const bool smooth_;
  std::vector<Matrix34d> original_;
  std::vector<const MatrixKey*> shown_;  // by the path before, a frame each; null: not
  int overlap_ = 0, anchors_ = 0;        // frames in common with the path before, and with the one after
  Seam seam_, last_seam_;
  ModelFitOptions fit_;
  ModelFit model_;
  std::vector<std::vector<WantedPoint>> points_;
  PathProblemOptions problem_;
  std::vector<Eigen::Matrix4d> steady_;  // of a smooth path
  std::vector<Matrix34d> P_;
  std::vector<double> follow_, log_follow_,
      scales_;  // a frame each: its pull towards the camera; the share of its picture that is known
};

}  // namespace

std::string Validate(const StabilizeOptions& o) {
  if (!(o.cutoff_hz > 0)) return "--cutoff-hz is positive";
  if (!(o.similar_hz > 0)) return "--similar-hz is positive";
  if (!(o.min_scale >= 0.2 && o.min_scale <= 1)) return "--min-scale is 0.2 to 1";
  if (o.half_window < 0 || o.half_window > 1000) return "--window is 1 to 2001 frames, odd";
  if (o.iterations < 0 || o.points < 8 || o.anchors < 0) return "--iterations is 0 and more, --points 8 and more";
  if (!o.object_px.empty() && (o.object_px.size() != 4 || !(o.object_px[2] > 0) || !(o.object_px[3] > 0)))
    return "--object is X,Y,WIDTH,HEIGHT in pixels";
  if (o.fps && !(*o.fps > 0 && *o.fps <= 1000)) return "--fps is above 0, up to 1000";
  return {};
}

MatrixPath Stabilize(const FilmedScene& film, const StabilizeOptions& options, StabilizeReport& report,
                     ProgressSink& progress) {
  if (const std::string wrong = Validate(options); !wrong.empty()) throw UsageError(wrong);
  return PathMaker(film, options, report).Make(progress);
}

}  // namespace lumi
