#include "stabilize/score/score.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>

#include "scene/files/video_clock.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"
#include "scene/program/stopwatch.h"
#include "stabilize/score/picture_match.h"

namespace lumi::score {
namespace {

constexpr std::size_t kBatch = 16;      // frames of each video in memory
constexpr int kShortestShot = 5;        // frames
constexpr int kMostBridged = 15;        // frames without features, over which the path is found again
constexpr double kStillPx = 0.1;        // of a path: what measuring a video of a tripod adds up to
constexpr double kLeastMeasured = 0.5;  // of the frames, for a figure
constexpr double kLeastCommon = 0.5;    // of the input's frames

// Luma as video has it, full range.
Image8 GreyOf(const Image8& rgb) {
  Image8 grey(rgb.width, rgb.height, 1);
  const std::uint8_t* p = rgb.data.data();
  for (std::uint8_t& g : grey.data) {
    g = static_cast<std::uint8_t>((77 * p[0] + 150 * p[1] + 29 * p[2] + 128) >> 8);
    p += 3;
  }
  return grey;
}

// One video while it is read.
class Meter {
 public:
  explicit Meter(const std::filesystem::path& file)
      : reader_(file), clock_(ReadUsableTimes(file)), jitter_(clock_.fps()) {
    score_.file = file;
    score_.fps = clock_.fps();
  }

  // The next frames into `pictures`; fewer at the end.
  void ReadBatch() {
    pictures.clear();
    batch_times_s_.clear();
    while (pictures.size() < kBatch) {
      CheckInterrupted();
      const auto frame = reader_.Next();
      if (!frame) return;
      Take(*frame);
    }
  }
  void MeasureBatch(std::size_t count, Progress& progress) {
    for (std::size_t i = 0; i < count; ++i) {
      Add(pictures[i], batch_times_s_[i]);
      progress.Step();
    }
  }

  void AddMatch(int frame, const std::optional<FittedHomography>& output_from_input, const Eigen::Vector2i& input_px) {
    const auto change = output_from_input ? ChangeOf(output_from_input->to_from, input_px, size_px()) : std::nullopt;
    if (!change) {
      ++score_.failed_matches;
      return;
    }
    ++matches_;
    cropping_sum_ += change->cropping;
    distortion_sum_ += change->distortion;
    kept_sum_ += change->kept_area;
    if (!score_.distortion || change->distortion < *score_.distortion) {
      score_.distortion = change->distortion;
      score_.distortion_frame = frame;
    }
  }

  Eigen::Vector2i size_px() const { return {score_.width_px, score_.height_px}; }
  int frames() const { return path_.frames(); }
  long frame_count_hint() const { return reader_.frame_count_hint(); }
  bool truncated() const { return reader_.truncated(); }
  std::vector<std::string> remarks() const { return reader_.remarks(); }

  // Frames of the whole video; those that are left are not looked at.
  int CountAll() {
    while (reader_.Skip()) CheckInterrupted();
    return reader_.frames_read();
  }

  VideoScore Finish(bool is_input, std::vector<std::string>& warnings) {
    const auto warn = [&](const std::string& what) {
      warnings.push_back(score_.file.filename().string() + ": " + what);
    };
    const int steps = frames() - 1;
    score_.failed_steps = path_.failed();
    score_.path = path_.Result();
    score_.uneven_times = score_.path.uneven;
    if (score_.uneven_times) warn("frames are not evenly spaced in time; the path is taken at even times");
    if (is_input) {
      score_.cropping_ratio = score_.distortion = score_.distortion_mean = score_.kept_area = 1.0;
    } else if (matches_ >= kLeastMeasured * frames()) {
      score_.cropping_ratio = cropping_sum_ / matches_;
      score_.distortion_mean = distortion_sum_ / matches_;
      score_.kept_area = kept_sum_ / matches_;
    } else {
      score_.distortion.reset();
    }
    if (score_.failed_matches > 0)
      warn(fmt::format("{} of {} frames are not to be found in the input's", score_.failed_matches, frames()));
    if (score_.failed_steps <= (1 - kLeastMeasured) * steps) {
      const double half_diagonal_px = 0.5 * size_px().cast<double>().norm();
      score_.stability_x = StabilityOf(score_.path.x_px, kStillPx);
      score_.stability_y = StabilityOf(score_.path.y_px, kStillPx);
      score_.stability_rotation = StabilityOf(score_.path.rotation_rad, kStillPx / half_diagonal_px);
      if (score_.stability_x) {
        score_.stability = std::min({*score_.stability_x, *score_.stability_y, *score_.stability_rotation});
        score_.stability_detrended =
            std::min({*StabilityOf(WithoutLine(score_.path.x_px), kStillPx),
                      *StabilityOf(WithoutLine(score_.path.y_px), kStillPx),
                      *StabilityOf(WithoutLine(score_.path.rotation_rad), kStillPx / half_diagonal_px)});
      } else {
        warn("too short for a stability score: 12 frames and more");
      }
    }
    if (score_.failed_steps > 0)
      warn(fmt::format("{} of {} frames have no movement from the one before: blank, blurred or without features",
                       score_.failed_steps, steps));
    score_.jitter = jitter_.Result();
    if (!score_.jitter.jitter_px) warn("no jitter: features have to be seen for 1.4 s, at 5 frames a second and more");
    return std::move(score_);
  }

  std::vector<Image8> pictures;  // grey, of the batch

 private:
  void Take(const VideoFrame& frame) {
    const Image8& rgb = frame.rgb;
    if (frame.index == 0) {
      score_.width_px = rgb.width;
      score_.height_px = rgb.height;
    } else if (rgb.width != score_.width_px || rgb.height != score_.height_px) {
      throw DataError(fmt::format("frame {} is {} x {} pixels, those before it {} x {}", frame.index, rgb.width,
                                  rgb.height, score_.width_px, score_.height_px),
                      "cut the video there", score_.file);
    }
    pictures.push_back(GreyOf(rgb));
    batch_times_s_.push_back(clock_.TimeOf(frame.time_s));
  }

  void Add(const Image8& grey, double time_s) {
    const int frame = path_.frames();
    const FollowedFrame followed = corners_.Add(grey);
    jitter_.Add(time_s, followed.corners);
    if (frame == 0) {
      path_.Begin(time_s);
      last_seen_ = grey;
      return;
    }
    // A shot of a few frames is none: noise, or a flash.
    if (followed.cut && frame >= last_break_ + kShortestShot) {
      last_break_ = frame;
      score_.cuts.push_back(frame);
      path_.Add(time_s, MeasuredPath::Step::kCut, {});
      last_seen_ = grey;
      return;
    }
    const auto fit = FitStep(followed.steps, InlierThresholdPx(size_px()));
    path_.Add(time_s, fit ? MeasuredPath::Step::kMeasured : MeasuredPath::Step::kFailed,
              fit ? MovementOf(fit->to_from, size_px()) : Movement{});
    if (fit) {
      last_seen_ = grey;
      return;
    }
    last_break_ = frame;
    if (path_.open_gap() > kMostBridged || followed.corners.empty()) return;
    const auto across = MatchPictures(PictureFeatures(last_seen_), PictureFeatures(grey));
    if (!across) return;
    path_.Bridge(path_.open_gap(), MovementOf(across->to_from, size_px()));
    last_seen_ = grey;
  }

  Image8 last_seen_;                 // the last frame on the path
  int last_break_ = -kShortestShot;  // the last frame that does not follow the one before, by a cut or by failing
  VideoReader reader_;
  VideoClock clock_;
  CornerFollower corners_;
  JitterMeter jitter_;
  MeasuredPath path_;
  VideoScore score_;
  std::vector<double> batch_times_s_;
  int matches_ = 0;
  double cropping_sum_ = 0, distortion_sum_ = 0, kept_sum_ = 0;
};

// Each stabilised frame against the input's, in the batch that was read.
void MatchBatch(std::deque<Meter>& meters, std::size_t count, int first_frame) {
  std::vector<std::optional<PictureFeatures>> features(count * meters.size());
  ParallelEach(features.size(), 1, [&](std::size_t i) { features[i].emplace(meters[i / count].pictures[i % count]); });
  std::vector<std::optional<FittedHomography>> found(count * (meters.size() - 1));
  ParallelEach(found.size(), 1,
               [&](std::size_t i) { found[i] = MatchPictures(*features[i % count], *features[count + i]); });
  for (std::size_t i = 0; i < found.size(); ++i)
    meters[1 + i / count].AddMatch(first_frame + static_cast<int>(i % count), found[i], meters[0].size_px());
}

}  // namespace

ScoreResult Score(const ScoreOptions& options, ProgressSink& sink) {
  const Stopwatch watch;
  std::deque<Meter> meters;
  meters.emplace_back(options.input);
  for (const auto& file : options.stabilised) meters.emplace_back(file);
  ScoreResult result;
  long expected = meters[0].frame_count_hint();
  for (const Meter& m : meters) expected = std::min(expected, m.frame_count_hint());
  {
    Progress progress(sink, "comparing videos", expected * static_cast<long>(meters.size()));
    for (;;) {
      ParallelEach(meters.size(), 1, [&](std::size_t i) { meters[i].ReadBatch(); });
      std::size_t common = kBatch;
      for (const Meter& m : meters) common = std::min(common, m.pictures.size());
      ParallelEach(meters.size(), 1, [&](std::size_t i) { meters[i].MeasureBatch(common, progress); });
      if (common > 0 && meters.size() > 1) MatchBatch(meters, common, result.frames);
      result.frames += static_cast<int>(common);
      if (common < kBatch) break;
    }
  }
  std::vector<int> lengths;
  for (Meter& m : meters) lengths.push_back(m.CountAll());
  for (std::size_t i = 0; i < meters.size(); ++i) {
    const auto& file = i == 0 ? options.input : options.stabilised[i - 1];
    if (lengths[i] == 0) throw InputError(file, "no frame of it can be decoded");
    if (lengths[i] == 1) throw DataError("has one frame: a video is wanted", {}, file);
    if (lengths[i] < kLeastCommon * lengths[0])
      throw DataError(fmt::format("has {} frames, the input {}: is it made from it?", lengths[i], lengths[0]),
                      "compare videos of the same frames", file);
    for (const std::string& remark : meters[i].remarks()) result.warnings.push_back(remark);
    if (meters[i].truncated()) result.warnings.push_back(file.filename().string() + ": is cut off");
    if (lengths[i] != lengths[0])
      result.warnings.push_back(fmt::format("{}: has {} frames, the input {}: the first {} are compared",
                                            file.filename().string(), lengths[i], lengths[0], result.frames));
  }
  for (std::size_t i = 0; i < meters.size(); ++i) result.videos.push_back(meters[i].Finish(i == 0, result.warnings));
  const VideoScore& input = result.videos[0];
  if (input.failed_steps > (1 - kLeastMeasured) * (result.frames - 1))
    throw DataError(fmt::format("in {} of {} frames there is nothing to follow", input.failed_steps, result.frames),
                    "is it blank, or too blurred?", options.input);
  for (const std::string& w : result.warnings) sink.Message(w);
  result.seconds = watch.Seconds();
  return result;
}

}  // namespace lumi::score
