#include "scene/files/ffmpeg/decoder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <optional>
#include <utility>

#include "scene/files/ffmpeg/deinterlace.h"
#include "scene/files/ffmpeg/input.h"
#include "scene/files/ffmpeg/second_fields.h"
#include "scene/files/ffmpeg/to_rgb.h"
#include "scene/program/error.h"

namespace lumi::ffmpeg {
namespace {

constexpr std::int64_t kMaxPixels = std::int64_t{1} << 27;  // of a frame: 16384 x 8192
constexpr int kMostErrors = 1000;                           // in a row, of the decoder: a damaged file's end
constexpr int kMostThreads = 16;                            // each holds a frame; FFmpeg warns of more
constexpr double kFewMissing = 0.1;                         // of a file's presentation times
constexpr std::int64_t kJudgedFrames = 24;                  // whether what is marked as interlaced is so
constexpr std::int64_t kJudgedBytes = std::int64_t{256} << 20;

class Decoder : public VideoDecoder {
 public:
  Decoder(const std::filesystem::path& path, int threads)
      : input_(path),
        threads_(std::max(1, threads)),
        packet_(av_packet_alloc()),
        second_fields_(*input_.video().codecpar) {
    const AVCodecParameters& stream = *input_.video().codecpar;
    const AVCodec* codec = avcodec_find_decoder(stream.codec_id);
    const auto refuse = [&](const std::string& why) {
      throw InputError(path, fmt::format("is not a video that can be read: {}", why),
                       "re-encode it: ffmpeg -i IN OUT.mp4");
    };
    if (!codec) refuse(fmt::format("this FFmpeg has no decoder of {}", avcodec_get_name(stream.codec_id)));
    context_.reset(avcodec_alloc_context3(codec));
    int error = avcodec_parameters_to_context(context_.get(), &stream);
    context_->pkt_timebase = input_.video().time_base;
    context_->thread_count = std::clamp(threads, 1, kMostThreads);
    context_->max_pixels = kMaxPixels;
    if (error >= 0) error = avcodec_open2(context_.get(), codec, nullptr);
    if (error < 0) refuse(Words(error));
    claims_ = input_.Claims();
    const Turn stated = input_.StatedTurn();
    claims_.width = stated.transpose ? stream.height : stream.width;
    claims_.height = stated.transpose ? stream.width : stream.height;
    // The first frame says what the container may not: its colours, a turn of its own. Without one, Grab is at the end.
    if (!Next()) return;
    ahead_ = true;
    const AVFrameSideData* own = av_frame_get_side_data(frame_.get(), AV_FRAME_DATA_DISPLAYMATRIX);
    const bool turned = own && own->size >= 9 * sizeof(std::int32_t);
    to_rgb_.emplace(path, *frame_, input_.PixelAspect(*frame_),
                    turned ? TurnOf(reinterpret_cast<const std::int32_t*>(own->data)) : stated, threads_);
    claims_.width = to_rgb_->width();
    claims_.height = to_rgb_->height();
    for (std::string& remark : to_rgb_->Remarks()) claims_.remarks.push_back(std::move(remark));
    if (second_fields_.any()) {
      const VideoClaims of_frames = ReadPacketTimes(path).claims;
      claims_.average_fps = of_frames.average_fps;
      claims_.frames = of_frames.frames;
      claims_.counted = of_frames.counted;
      claims_.duration_s = of_frames.duration_s;
    }
  }

  bool Grab() override { return std::exchange(ahead_, false) || Next(); }
  double StatedTime_s() override { return input_.Seconds(stamp_); }
  Image8 Picture() override { return to_rgb_->Convert(*frame_); }
  const VideoClaims& claims() override { return claims_; }

 private:
  // The next frame that is shown, deinterlaced where it has to be.
  bool Next() {
    for (;;) {
      if (deinterlacer_) {
        if (deinterlacer_->Receive(*frame_, stamp_)) return true;
        if (deinterlacer_->ended()) deinterlacer_.reset();
      }
      if (!NextCoded()) {
        if (!deinterlacer_) return false;
        deinterlacer_->End();
        continue;
      }
      if (!deinterlacer_) {
        if (!MarkedInterlaced(*frame_)) {
          if (fields_ == false) fields_.reset();  // what is marked later may be interlaced
          return true;
        }
        if (!fields_) {
          JudgeFields();
          continue;
        }
        if (!*fields_ || !PrepareDeinterlacer()) return true;
      } else if (!deinterlacer_->Takes(*frame_)) {
        PutBack();
        deinterlacer_->End();
        fields_.reset();
        continue;
      }
      deinterlacer_->Send(*frame_, stamp_);
    }
  }

  // frame_ is the first of frames that are marked as interlaced: looks at those after it.
  void JudgeFields() {
    // HEVC has no interlaced frames: each field is a frame of half the height.
    if (context_->codec_id == AV_CODEC_ID_HEVC) {
      Remark("has fields as frames of half the height: they are used as they are");
      fields_ = false;
      return PutBack();
    }
    std::deque<Coded> judged;
    const auto most =
        std::clamp<std::int64_t>(kJudgedBytes / (3 * std::int64_t{frame_->width} * frame_->height), 2, kJudgedFrames);
    for (;;) {
      judged.push_back(TakeCoded());
      if (static_cast<std::int64_t>(judged.size()) >= most || !NextCoded()) break;
      if (MarkedInterlaced(*frame_)) continue;
      PutBack();
      break;
    }
    std::deque<const AVFrame*> frames;
    for (const Coded& coded : judged) frames.push_back(coded.frame.get());
    // Where nothing tells, as it was before.
    const std::optional<bool> of_one_moment = OfOneMoment(frames, threads_);
    fields_ = of_one_moment ? !*of_one_moment : judged_before_.value_or(true);
    judged_before_ = fields_;
    for (; !judged.empty(); judged.pop_back()) coded_.push_front(std::move(judged.back()));
  }

  // For frames as frame_ is.
  bool PrepareDeinterlacer() {
    deinterlacer_.emplace(input_.path());
    if (deinterlacer_->Prepare(*frame_, threads_)) {
      Remark("is interlaced: each frame becomes a picture of one moment");
      return true;
    }
    Remark("is interlaced, and this FFmpeg cannot deinterlace it: what moves is torn into lines");
    deinterlacer_.reset();
    fields_ = false;
    return false;
  }

  void Remark(const std::string& what) {
    const std::string remark = fmt::format("{} {}", input_.path().filename().string(), what);
    if (std::ranges::find(claims_.remarks, remark) == claims_.remarks.end()) claims_.remarks.push_back(remark);
  }

  struct Coded {
    FramePtr frame;
    std::int64_t stamp = AV_NOPTS_VALUE;
  };
  Coded TakeCoded() {
    Coded coded{FramePtr(av_frame_alloc()), stamp_};
    av_frame_move_ref(coded.frame.get(), frame_.get());
    return coded;
  }
  void PutBack() { coded_.push_front(TakeCoded()); }

  bool NextCoded() {
    if (coded_.empty()) return Decode();
    av_frame_unref(frame_.get());
    av_frame_move_ref(frame_.get(), coded_.front().frame.get());
    stamp_ = coded_.front().stamp;
    coded_.pop_front();
    return true;
  }

  // Packets that cannot be decoded are passed over; a file that is cut off ends where it is.
  bool Decode() {
    for (int errors = 0; errors < kMostErrors;) {
      const int got = avcodec_receive_frame(context_.get(), frame_.get());
      if (got >= 0 && frame_->width > 0 && frame_->height > 0) {
        TakeStamp();
        return true;
      }
      if (got == AVERROR_EOF) return false;
      if (got != AVERROR(EAGAIN)) {
        ++errors;
        continue;
      }
      const bool more = input_.Read(*packet_);
      if (more) NoteStamp(*packet_);
      if (avcodec_send_packet(context_.get(), more ? packet_.get() : nullptr) < 0) ++errors;
    }
    return false;
  }

  // Some containers (AVI, most of MPEG) state decoding times, and presentation times for few frames or for none. The
  // sorted decoding times are then the presentation times, up to a delay that is the same for all frames. The decoder
  // itself has no time for its last frames.
  void NoteStamp(const AVPacket& packet) {
    any_key_ |= (packet.flags & AV_PKT_FLAG_KEY) != 0;
    const SecondFields::Kind kind = second_fields_.Of(packet);
    if (kind == SecondFields::kSecond) return;
    if (kind == SecondFields::kAfterLone && noted_) {
      --stamps_;
      without_pts_ -= noted_->pts == AV_NOPTS_VALUE;
      if (noted_->dts != AV_NOPTS_VALUE && !dts_.empty()) dts_.pop_back();
    }
    noted_.reset();
    if (!any_key_ || (packet.flags & AV_PKT_FLAG_DISCARD)) return;
    ++stamps_;
    without_pts_ += packet.pts == AV_NOPTS_VALUE;
    if (packet.dts != AV_NOPTS_VALUE) dts_.push_back(packet.dts);
    noted_ = Noted{packet.pts, packet.dts};
  }
  void TakeStamp() {
    if (!by_dts_) by_dts_ = without_pts_ > kFewMissing * stamps_ && static_cast<int>(dts_.size()) == stamps_;
    stamp_ = frame_->best_effort_timestamp;
    if (dts_.empty()) return;
    if (*by_dts_) stamp_ = dts_.front();
    dts_.pop_front();
  }

  Input input_;
  int threads_ = 1;
  PacketPtr packet_;
  SecondFields second_fields_;
  CodecPtr context_;
  FramePtr frame_{av_frame_alloc()};
  std::deque<Coded> coded_;     // looked at ahead or put back; they come before the decoder's
  std::optional<bool> fields_;  // whether frames that are marked as interlaced are deinterlaced; none: not known yet
  std::optional<bool> judged_before_;  // fields_, as it was last known
  std::optional<Deinterlacer> deinterlacer_;
  std::optional<ToRgb> to_rgb_;
  VideoClaims claims_;
  bool ahead_ = false;                   // frame_ is decoded and not grabbed yet
  std::int64_t stamp_ = AV_NOPTS_VALUE;  // of frame_
  std::deque<std::int64_t> dts_;         // of packets that are decoded and not shown
  int stamps_ = 0, without_pts_ = 0;
  struct Noted {
    std::int64_t pts, dts;
  };
  std::optional<Noted> noted_;  // of the packet before, if it counts
  bool any_key_ = false;
  std::optional<bool> by_dts_;  // decided with the first frame
};

struct Stamp {
  double pts_s = 0, dts_s = 0;
};

// Where fields are coded one by one, a file's own number and rate are of fields, or of neither.
void CountFrames(const std::vector<double>& stated_s, VideoClaims& claims) {
  if (claims.counted && claims.average_fps > 0)
    claims.duration_s = static_cast<double>(claims.frames) / claims.average_fps;
  claims.counted = false;  // a file that is cut off claims more than it holds
  claims.frames = static_cast<long>(stated_s.size());
  double first_s = NAN, last_s = NAN;
  long times = 0;
  for (const double s : stated_s) {
    first_s = std::fmin(first_s, s), last_s = std::fmax(last_s, s);  // one of the two may be NaN
    times += !std::isnan(s);
  }
  if (last_s > first_s) claims.average_fps = static_cast<double>(times - 1) / (last_s - first_s);
}

// Packets come in the order of decoding. Frames are shown in that of their presentation times, as long as the file's
// clock goes on; where it is set back (two recordings in one file), what follows is shown after what came before.
void AppendShown(std::vector<Stamp>& run, std::vector<double>& stated_s) {
  std::vector<double> times;
  for (const Stamp& s : run)
    if (!std::isnan(s.pts_s)) times.push_back(s.pts_s);
  if (const auto missing = static_cast<double>(run.size() - times.size());
      missing > kFewMissing * static_cast<double>(run.size())) {
    times.clear();  // by the times of decoding, as the decoder above
    for (const Stamp& s : run)
      if (!std::isnan(s.dts_s)) times.push_back(s.dts_s);
  }
  std::sort(times.begin(), times.end());
  times.resize(run.size(), std::numeric_limits<double>::quiet_NaN());
  stated_s.insert(stated_s.end(), times.begin(), times.end());
  run.clear();
}

}  // namespace

std::unique_ptr<VideoDecoder> OpenDecoder(const std::filesystem::path& path, int threads) {
  return std::make_unique<Decoder>(path, threads);
}

std::string ReadComment(const std::filesystem::path& path) { return Input(path).Comment(); }

PacketTimes ReadPacketTimes(const std::filesystem::path& path) {
  constexpr double kClockSetBack_s = 0.5;  // more than frames are ever reordered by, where decoding times are missing
  Input input(path);
  const PacketPtr packet(av_packet_alloc());
  PacketTimes times;
  times.claims = input.Claims();
  std::vector<Stamp> run;
  double last_dts_s = NAN, latest_pts_s = NAN, first_key_s = NAN;
  bool any_key = false, listed = false;  // listed: the packet before is the last of the run
  SecondFields second_fields(*input.video().codecpar);
  while (input.Read(*packet)) {
    const SecondFields::Kind kind = second_fields.Of(*packet);
    if (kind == SecondFields::kAfterLone && listed) run.pop_back();
    listed = false;
    const Stamp s{input.Seconds(packet->pts), input.Seconds(packet->dts)};
    // Packets before the first key frame are not shown, nor are packets after it whose presentation time is before the
    // key frame's.
    if (!any_key && (packet->flags & AV_PKT_FLAG_KEY)) {
      any_key = true;
      first_key_s = s.pts_s;
    }
    if (kind == SecondFields::kSecond) continue;
    if (!any_key || (packet->flags & AV_PKT_FLAG_DISCARD)) continue;  // an edit list makes FFmpeg set DISCARD
    const bool set_back = std::isnan(s.dts_s) ? s.pts_s < latest_pts_s - kClockSetBack_s : s.dts_s < last_dts_s;
    if (set_back) {
      AppendShown(run, times.stated_s);
      latest_pts_s = first_key_s = NAN;
    }
    if (s.pts_s < first_key_s) continue;
    run.push_back(s);
    listed = true;
    last_dts_s = s.dts_s;
    latest_pts_s = std::fmax(latest_pts_s, s.pts_s);  // fmax: one of the two may be NaN
  }
  AppendShown(run, times.stated_s);
  if (second_fields.any()) CountFrames(times.stated_s, times.claims);
  return times;
}

}  // namespace lumi::ffmpeg
