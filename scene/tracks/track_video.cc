#include "scene/tracks/track_video.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <future>
#include <memory>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "scene/files/opencv_pixels.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"
#include "scene/program/stopwatch.h"
#include "scene/tracks/affine_patch.h"

namespace lumi {
namespace {

// Frames decoded at once, while the ones before are tracked.
constexpr int kBatch = 8;
// Corners wanted in one cell of the grid that spreads them.
constexpr int kCornersPerCell = 4;
// Neighbourhood over which a corner's gradients are summed.
constexpr int kCornerBlock = 7;
// Mean squared gradient in a corner's weakest direction, (grey levels / px)^2: sensor noise of 2 grey levels gives 0.6.
constexpr double kMinCorner = 1.0;
// Distance between corners in units of sqrt(pixels / features): a frame that is half blank still holds all of them.
constexpr double kSpacing = 0.35;
// Tracks as close as this part of the spacing have met.
constexpr double kMeeting = 0.4;
// Beyond this change of scale the patch is taken anew: it has other detail now.
constexpr double kRenewScale = 1.5;
// Neighbours that say where a corner went that was not found.
constexpr std::size_t kNeighbours = 7;
// The most corners begun in a frame, in units of TrackVideoOptions::features.
constexpr double kMostNew = 3;
// With fewer tracks than these nothing can be said of a cut.
constexpr std::size_t kTracksForCut = 20;

struct Frame {
  Image8 rgb;  // 1 or 3 channels
  Image8 mask;
  cv::Mat grey;
  std::vector<cv::Mat> pyramid;
  ImageF smooth;  // the patches' frame: a little smoothing makes bilinear samples of it unbiased
};

std::unique_ptr<Frame> Load(const FrameSource& source, int i, const TrackVideoOptions& o) {
  auto loaded = tracks_internal::LoadFrame(source, i);
  auto f = std::make_unique<Frame>();
  f->rgb = std::move(loaded.image);
  f->mask = std::move(loaded.mask);
  const cv::Mat view(f->rgb.height, f->rgb.width, f->rgb.channels == 3 ? CV_8UC3 : CV_8UC1, f->rgb.data.data());
  if (f->rgb.channels == 3)
    cv::cvtColor(view, f->grey, cv::COLOR_RGB2GRAY);
  else
    f->grey = view;
  cv::buildOpticalFlowPyramid(f->grey, f->pyramid, cv::Size(o.window_px, o.window_px), o.levels);
  f->smooth = ImageF(f->rgb.width, f->rgb.height, 1);
  cv::Mat smooth(f->rgb.height, f->rgb.width, CV_32F, f->smooth.data.data()), wide;
  f->grey.convertTo(wide, CV_32F);
  cv::GaussianBlur(wide, smooth, cv::Size(5, 5), 0.8);
  return f;
}

std::vector<std::unique_ptr<Frame>> LoadBatch(const FrameSource& source, int first, int count,
                                              const TrackVideoOptions& o) {
  std::vector<std::unique_ptr<Frame>> frames(static_cast<std::size_t>(count));
  if (source.in_order) {
    for (int i = 0; i < count; ++i) frames[static_cast<std::size_t>(i)] = Load(source, first + i, o);
    return frames;
  }
  ParallelEach(frames.size(), 1, [&](std::size_t i) { frames[i] = Load(source, first + static_cast<int>(i), o); });
  return frames;
}

// Places that are taken, so that corners keep their distance.
class Places {
 public:
  Places(int width, int height, double distance_px)
      : distance_(distance_px),
        columns_(static_cast<int>(width / distance_px) + 1),
        rows_(static_cast<int>(height / distance_px) + 1),
        cells_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_)) {}
  bool Free(const Eigen::Vector2d& x) const {
    const int cx = Column(x), cy = Row(x);
    for (int y = std::max(0, cy - 1); y <= std::min(rows_ - 1, cy + 1); ++y)
      for (int u = std::max(0, cx - 1); u <= std::min(columns_ - 1, cx + 1); ++u)
        for (const Eigen::Vector2d& other : cells_[static_cast<std::size_t>(y * columns_ + u)])
          if ((x - other).squaredNorm() < distance_ * distance_) return false;
    return true;
  }
  void Take(const Eigen::Vector2d& x) { cells_[static_cast<std::size_t>(Row(x) * columns_ + Column(x))].push_back(x); }

 private:
  int Column(const Eigen::Vector2d& x) const {
    return std::clamp(static_cast<int>(x.x() / distance_), 0, columns_ - 1);
  }
  int Row(const Eigen::Vector2d& x) const { return std::clamp(static_cast<int>(x.y() / distance_), 0, rows_ - 1); }
  double distance_;
  int columns_, rows_;
  std::vector<std::vector<Eigen::Vector2d>> cells_;
};

bool Masked(const Frame& f, const Eigen::Vector2d& x_px) {
  if (f.mask.empty()) return false;
  const int x = std::clamp(static_cast<int>(x_px.x()), 0, f.mask.width - 1),
            y = std::clamp(static_cast<int>(x_px.y()), 0, f.mask.height - 1);
  return f.mask.At(x, y, 0) == 0;
}

struct Alive {
  std::size_t track;
  Eigen::Vector2d lk_px;  // Lucas-Kanade's own position, without the first patch's
  PatchPose pose;
  std::shared_ptr<const AffinePatch> patch;
};

class Tracker {
 public:
  Tracker(const FrameSource& source, const TrackVideoOptions& options, TrackVideoSummary& summary, Tracks& tracks)
      : source_(source), o_(options), summary_(summary), tracks_(tracks) {}

  void Add(std::unique_ptr<Frame> frame) {
    const int index = static_cast<int>(tracks_.frames.size());
    const Eigen::Vector2i size(frame->rgb.width, frame->rgb.height);
    const std::string& name = source_.names[static_cast<std::size_t>(index)];
    if (previous_ && size != tracks_.frames.front().size_px)
      throw DataError(fmt::format("the frame is {} x {} pixels, those before it {} x {}", size.x(), size.y(),
                                  tracks_.frames.front().size_px.x(), tracks_.frames.front().size_px.y()),
                      "a video's frames have one size: leave this one out or scale it", source_.folder / name);
    tracks_.frames.push_back({name, size});
    if (!previous_) {
      spacing_px_ = std::max(3.0, kSpacing * std::sqrt(static_cast<double>(size.x()) * size.y() / o_.features));
      // Below the size of a patch there is no place for a corner.
      fits_ = std::min(size.x(), size.y()) > o_.patch_px + 4;
    } else if (fits_) {
      if (cv::norm(previous_->grey, frame->grey, cv::NORM_INF) == 0)
        Repeat(*frame);
      else
        Follow(*frame, index);
    }
    for (const Alive& a : alive_) tracks_.tracks[a.track].observations.push_back({index, a.pose.x_px});
    if (fits_) FindCorners(*frame, index);
    if (alive_.empty()) ++summary_.blank_frames;
    previous_ = std::move(frame);
  }

 private:
  // Nothing moves between equal frames, not even by a rounding. The mask may be another one.
  void Repeat(const Frame& frame) {
    summary_.repeated.push_back(static_cast<int>(tracks_.frames.size()) - 1);
    summary_.ended_masked +=
        static_cast<int>(std::erase_if(alive_, [&](const Alive& a) { return Masked(frame, a.pose.x_px); }));
  }

  struct Flow {
    bool found = false;
    Eigen::Vector2d step_px = Eigen::Vector2d::Zero();
  };

  // There and back, for those of `which`, from a guess of each one's step.
  void LucasKanade(const Frame& frame, const std::vector<std::size_t>& which, const std::vector<Eigen::Vector2d>& guess,
                   std::vector<Flow>& flow) const {
    if (which.empty()) return;
    std::vector<cv::Point2f> from, to, back;
    for (std::size_t k = 0; k < which.size(); ++k) {
      const Eigen::Vector2d x = ToOpenCvPixel(alive_[which[k]].lk_px), y = x + guess[k];
      from.emplace_back(static_cast<float>(x.x()), static_cast<float>(x.y()));
      to.emplace_back(static_cast<float>(y.x()), static_cast<float>(y.y()));
    }
    std::vector<unsigned char> there, here;
    std::vector<float> error;
    const cv::Size window(o_.window_px, o_.window_px);
    const cv::TermCriteria criteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 30, 0.005);
    cv::calcOpticalFlowPyrLK(previous_->pyramid, frame.pyramid, from, to, there, error, window, o_.levels, criteria,
                             cv::OPTFLOW_USE_INITIAL_FLOW);
    // The backward search starts as far from its goal as the forward one did; started at the goal, it would be no
    // check.
    for (std::size_t k = 0; k < which.size(); ++k)
      back.emplace_back(to[k].x - static_cast<float>(guess[k].x()), to[k].y - static_cast<float>(guess[k].y()));
    cv::calcOpticalFlowPyrLK(frame.pyramid, previous_->pyramid, to, back, here, error, window, o_.levels, criteria,
                             cv::OPTFLOW_USE_INITIAL_FLOW);
    for (std::size_t k = 0; k < which.size(); ++k) {
      Flow& f = flow[which[k]];
      f.found =
          there[k] && here[k] && std::hypot(back[k].x - from[k].x, back[k].y - from[k].y) < o_.forward_backward_px;
      f.step_px = {to[k].x - from[k].x, to[k].y - from[k].y};
    }
  }

  // All corners first without a guess; those that are not found are tried again from where their neighbours went.
  std::vector<Flow> FollowCorners(const Frame& frame) const {
    std::vector<Flow> flow(alive_.size());
    std::vector<std::size_t> which(alive_.size());
    std::iota(which.begin(), which.end(), std::size_t{0});
    LucasKanade(frame, which, std::vector<Eigen::Vector2d>(which.size(), Eigen::Vector2d::Zero()), flow);
    std::vector<std::size_t> found;
    which.clear();
    for (std::size_t i = 0; i < flow.size(); ++i) (flow[i].found ? found : which).push_back(i);
    if (found.size() < kNeighbours ||
        static_cast<double>(found.size()) < o_.cut_share * static_cast<double>(flow.size()))
      return flow;
    std::vector<Eigen::Vector2d> guess(which.size());
    ParallelFor(which.size(), 16, [&](std::size_t begin, std::size_t end) {
      std::vector<std::pair<double, std::size_t>> near;
      for (std::size_t k = begin; k < end; ++k) {
        near.clear();
        for (const std::size_t j : found)
          near.emplace_back((alive_[j].lk_px - alive_[which[k]].lk_px).squaredNorm(), j);
        std::partial_sort(near.begin(), near.begin() + kNeighbours, near.end());
        for (int axis = 0; axis < 2; ++axis) {
          std::array<double, kNeighbours> steps;
          for (std::size_t n = 0; n < kNeighbours; ++n) steps[n] = flow[near[n].second].step_px[axis];
          std::nth_element(steps.begin(), steps.begin() + kNeighbours / 2, steps.end());
          guess[k][axis] = steps[kNeighbours / 2];
        }
      }
    });
    LucasKanade(frame, which, guess, flow);
    return flow;
  }

  void Follow(const Frame& frame, int index) {
    if (alive_.empty()) return;
    enum class End { kNone, kLost, kChanged, kMasked };
    const std::vector<Flow> flow = FollowCorners(frame);
    std::vector<End> end(alive_.size(), End::kNone);
    ParallelEach(alive_.size(), 16, [&](std::size_t i) {
      Alive& a = alive_[i];
      if (!flow[i].found) {
        end[i] = End::kLost;
        return;
      }
      const Eigen::Vector2d& step = flow[i].step_px;
      a.lk_px += step;
      const auto match = AlignPatch(*a.patch, frame.smooth, {a.pose.x_px + step, a.pose.A});
      if (!match || match->correlation < o_.min_correlation) {
        end[i] = End::kChanged;
        return;
      }
      a.pose = match->pose;
      if (o_.hold_to_first_patch)
        a.lk_px = a.pose.x_px;
      else
        a.pose.x_px = a.lk_px;
      if (Masked(frame, a.pose.x_px)) {
        end[i] = End::kMasked;
        return;
      }
      const double area = std::abs(a.pose.A(0, 0) * a.pose.A(1, 1) - a.pose.A(0, 1) * a.pose.A(1, 0));
      if (area > kRenewScale * kRenewScale || area < 1 / (kRenewScale * kRenewScale)) {
        if (auto patch = TakePatch(frame.smooth, a.pose.x_px, o_.patch_px / 2)) {
          a.patch = std::make_shared<const AffinePatch>(std::move(*patch));
          a.pose.A.setIdentity();
        }
      }
    });

    // How many of the corners begun in the frame before can be followed at all: FindCorners begins more where few can.
    double begun = 0, survived = 0;
    for (std::size_t i = 0; i < alive_.size(); ++i) {
      if (tracks_.tracks[alive_[i].track].observations.size() > 1) continue;
      ++begun;
      survived += end[i] == End::kNone;
    }
    if (begun >= kTracksForCut) survival_ = std::max(1 / kMostNew, survived / begun);

    const auto followed = static_cast<std::size_t>(std::count(end.begin(), end.end(), End::kNone));
    if (alive_.size() >= kTracksForCut &&
        static_cast<double>(followed) < o_.cut_share * static_cast<double>(alive_.size())) {
      summary_.cuts.push_back(index);
      summary_.ended_lost += static_cast<int>(alive_.size());
      alive_.clear();
      return;
    }
    // Older tracks stand first: where two meet the younger one ends.
    Places places(frame.rgb.width, frame.rgb.height, std::max(1.0, kMeeting * spacing_px_));
    std::vector<Alive> still;
    still.reserve(alive_.size());
    for (std::size_t i = 0; i < alive_.size(); ++i) {
      summary_.ended_lost += end[i] == End::kLost;
      summary_.ended_changed += end[i] == End::kChanged;
      summary_.ended_masked += end[i] == End::kMasked;
      if (end[i] != End::kNone) continue;
      if (!places.Free(alive_[i].pose.x_px)) {
        ++summary_.ended_crowded;
        continue;
      }
      places.Take(alive_[i].pose.x_px);
      still.push_back(std::move(alive_[i]));
    }
    // More of the new corners were found than hoped for: the weakest stand last.
    while (still.size() > static_cast<std::size_t>(o_.features) &&
           tracks_.tracks[still.back().track].observations.size() == 1)
      still.pop_back();
    alive_ = std::move(still);
  }

  struct Corner {
    float strength;
    int x, y;
    bool operator<(const Corner& other) const {
      return std::tie(other.strength, y, x) < std::tie(strength, other.y, other.x);
    }
  };

  // Fills up to o_.features: first cell by cell, then from what the cells have left, strongest first.
  void FindCorners(const Frame& frame, int index) {
    if (alive_.size() >= static_cast<std::size_t>(o_.features)) return;
    const auto missing = static_cast<double>(static_cast<std::size_t>(o_.features) - alive_.size());
    const auto wanted = alive_.size() + static_cast<std::size_t>(std::min(missing / survival_, kMostNew * o_.features));
    const int width = frame.grey.cols, height = frame.grey.rows, margin = o_.patch_px / 2 + 2;
    const int cell_px = std::max(
        o_.patch_px, static_cast<int>(std::sqrt(static_cast<double>(width) * height * kCornersPerCell / o_.features)));
    const int columns = (width + cell_px - 1) / cell_px, rows = (height + cell_px - 1) / cell_px;
    const auto cell_count = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);

    Places places(width, height, spacing_px_);
    std::vector<int> has(cell_count, 0);
    for (const Alive& a : alive_) {
      places.Take(a.pose.x_px);
      const int cx = std::clamp(static_cast<int>(a.pose.x_px.x()) / cell_px, 0, columns - 1),
                cy = std::clamp(static_cast<int>(a.pose.x_px.y()) / cell_px, 0, rows - 1);
      ++has[static_cast<std::size_t>(cy * columns + cx)];
    }

    cv::Mat strength;
    cv::cornerMinEigenVal(frame.grey, strength, kCornerBlock, 3);
    // OpenCV's eigenvalues are of the summed gradients, scaled by (4 block 255)^-2 with Sobel's factor of 8 in them.
    constexpr double kScale =
        64.0 * kCornerBlock * kCornerBlock / (4.0 * kCornerBlock * 255 * 4.0 * kCornerBlock * 255);
    const float threshold = static_cast<float>(kMinCorner * kScale);
    std::vector<std::vector<Corner>> corners(cell_count);
    ParallelEach(cell_count, 4, [&](std::size_t cell) {
      const int x0 = static_cast<int>(cell) % columns * cell_px, y0 = static_cast<int>(cell) / columns * cell_px;
      for (int y = std::max(margin, y0); y < std::min(height - margin, y0 + cell_px); ++y) {
        const float* above = strength.ptr<float>(y - 1);
        const float* row = strength.ptr<float>(y);
        const float* below = strength.ptr<float>(y + 1);
        for (int x = std::max(margin, x0); x < std::min(width - margin, x0 + cell_px); ++x) {
          const float s = row[x];
          if (!(s > threshold)) continue;
          // Strictly above those before it: a plateau has one corner.
          if (s <= above[x - 1] || s <= above[x] || s <= above[x + 1] || s <= row[x - 1]) continue;
          if (s < row[x + 1] || s < below[x - 1] || s < below[x] || s < below[x + 1]) continue;
          const Eigen::Vector2d centre(x + 0.5, y + 0.5);
          if (Masked(frame, centre) || !places.Free(centre)) continue;
          corners[cell].push_back({s, x, y});
        }
      }
      std::sort(corners[cell].begin(), corners[cell].end());
    });

    const auto begin_track = [&](const Corner& c) {
      const Eigen::Vector2d x_px = FromOpenCvPixel({c.x, c.y});
      if (!places.Free(x_px)) return false;
      auto patch = TakePatch(frame.smooth, x_px, o_.patch_px / 2);
      if (!patch) return false;
      places.Take(x_px);
      Track track;
      track.observations.push_back({index, x_px});
      for (int k = 0; k < 3; ++k)
        track.color[static_cast<std::size_t>(k)] = frame.rgb.At(c.x, c.y, frame.rgb.channels == 3 ? k : 0);
      alive_.push_back({tracks_.tracks.size(),
                        x_px,
                        {x_px, Eigen::Matrix2d::Identity()},
                        std::make_shared<const AffinePatch>(std::move(*patch))});
      tracks_.tracks.push_back(std::move(track));
      return true;
    };
    std::vector<Corner> left;
    for (std::size_t cell = 0; cell < cell_count; ++cell)
      for (const Corner& c : corners[cell]) {
        if (has[cell] >= kCornersPerCell)
          left.push_back(c);
        else
          has[cell] += begin_track(c);
      }
    std::sort(left.begin(), left.end());
    for (const Corner& c : left) {
      if (alive_.size() >= wanted) break;
      begin_track(c);
    }
  }

  const FrameSource& source_;
  const TrackVideoOptions& o_;
  TrackVideoSummary& summary_;
  Tracks& tracks_;
  std::unique_ptr<Frame> previous_;
  std::vector<Alive> alive_;  // oldest first
  double spacing_px_ = 0;
  double survival_ =
      1 / kMostNew;  // share of new corners that are found in the next frame; nothing is known of it at first
  bool fits_ = false;
};

}  // namespace

std::optional<std::string> Validate(const TrackVideoOptions& o) {
  if (o.features < 8) return "features a frame: 8 and more";
  if (o.min_length < 2) return "a track's minimum length: 2 frames and more";
  if (o.window_px < 5 || o.window_px > 101 || o.window_px % 2 == 0)
    return "the window: an odd number of pixels, 5 to 101";
  if (o.levels < 0 || o.levels > 10) return "levels: 0 to 10";
  if (!(o.forward_backward_px > 0)) return "the forward-backward threshold: above 0 pixels";
  if (o.patch_px < 7 || o.patch_px > 61 || o.patch_px % 2 == 0) return "the patch: an odd number of pixels, 7 to 61";
  if (!(o.min_correlation >= 0 && o.min_correlation < 1)) return "the least correlation: 0 and more, below 1";
  if (!(o.cut_share >= 0 && o.cut_share <= 1)) return "the share that tells a cut: 0 to 1";
  return std::nullopt;
}

Tracks TrackVideo(const FrameSource& source, const TrackVideoOptions& options, ProgressSink& sink,
                  TrackVideoSummary* summary) {
  if (const auto wrong = Validate(options)) throw UsageError(*wrong);
  const Stopwatch watch;
  TrackVideoSummary own;
  TrackVideoSummary& s = summary ? *summary : own;
  s = {};
  Tracks tracks;
  {
    Tracker tracker(source, options, s, tracks);
    Progress progress(sink, "following corners", source.count());
    const auto batch_size = [&](int first) { return std::min(kBatch, source.count() - first); };
    // One core has no use for decoding beside it.
    const auto policy = ThreadCount() > 1 ? std::launch::async : std::launch::deferred;
    const auto load = [&](int first) {
      return std::async(policy, [&source, &options, first, count = batch_size(first)] {
        return LoadBatch(source, first, count, options);
      });
    };
    std::future<std::vector<std::unique_ptr<Frame>>> next;
    if (source.count() > 0) next = load(0);
    for (int first = 0; first < source.count(); first += kBatch) {
      auto frames = next.get();
      if (first + kBatch < source.count()) next = load(first + kBatch);
      for (auto& frame : frames) {
        tracker.Add(std::move(frame));
        progress.Step();
      }
    }
  }
  s.dropped_short = static_cast<int>(std::erase_if(
      tracks.tracks, [&](const Track& t) { return static_cast<int>(t.observations.size()) < options.min_length; }));
  s.alive.assign(tracks.frames.size(), 0);
  for (const Track& t : tracks.tracks)
    for (const TrackObservation& o : t.observations) ++s.alive[static_cast<std::size_t>(o.frame)];
  s.seconds = watch.Seconds();

  if (source.count() > 0 && s.blank_frames == source.count())
    sink.Message(fmt::format(
        "no corner was found in any of the {} frames: they are blank, blurred, masked or too small", source.count()));
  else if (s.blank_frames > 0)
    sink.Message(fmt::format("{} of {} frames have no corner: they are blank, blurred or masked", s.blank_frames,
                             source.count()));
  if (!s.cuts.empty())
    sink.Message(fmt::format("{} cut{} in the video, the first at {}: tracks end there", s.cuts.size(),
                             s.cuts.size() > 1 ? "s" : "", source.names[static_cast<std::size_t>(s.cuts.front())]));
  return tracks;
}

}  // namespace lumi
