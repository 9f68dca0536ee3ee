#include "scene/files/ffmpeg/input.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <string_view>

extern "C" {
#include <libavutil/dict.h>
#include <libavutil/dovi_meta.h>
#include <libavutil/mem.h>
}

#include "scene/files/open_to_read.h"
#include "scene/program/error.h"

namespace lumi::ffmpeg {
namespace {

constexpr int kBufferBytes = 1 << 16;
constexpr double kMaxFps = 1000;        // beyond: a container's time base, not its rate
constexpr double kStraightTurn = 0.02;  // sine of about a degree
constexpr double kMostFrames = 1e9;     // more is a damaged header
// One allocation of FFmpeg's: a frame of 16384 x 8192 pixels, 4 bytes each. A few bytes may claim an index of
// gigabytes.
constexpr std::size_t kMaxAllocation_bytes = (std::size_t{1} << 29) + (std::size_t{1} << 20);

int ReadFile(void* file, std::uint8_t* to, int size) {
  const ssize_t n = ::read(*static_cast<int*>(file), to, static_cast<std::size_t>(size));
  return n > 0 ? static_cast<int>(n) : n == 0 ? AVERROR_EOF : AVERROR(errno);
}

std::int64_t SeekFile(void* file, std::int64_t to, int whence) {
  if (whence & AVSEEK_SIZE) {
    struct stat status {};
    return ::fstat(*static_cast<int*>(file), &status) == 0 ? status.st_size : AVERROR(errno);
  }
  const off_t at = ::lseek(*static_cast<int*>(file), to, whence & ~AVSEEK_FORCE);
  return at < 0 ? AVERROR(errno) : at;
}

// A playlist inside a file with a video's name would have FFmpeg open other files, or the network.
int OpenNothing(AVFormatContext*, AVIOContext**, const char*, int, AVDictionary**) { return AVERROR(EACCES); }

double Rate(AVRational rate) {
  const double r = rate.num > 0 && rate.den > 0 ? av_q2d(rate) : 0;
  return r <= kMaxFps ? r : 0;
}

const std::uint8_t* SideData(const AVStream& stream, AVPacketSideDataType type, std::size_t least) {
#if LIBAVFORMAT_VERSION_MAJOR >= 61
  const AVPacketSideData* data =
      av_packet_side_data_get(stream.codecpar->coded_side_data, stream.codecpar->nb_coded_side_data, type);
  return data && data->size >= least ? data->data : nullptr;
#else
  std::size_t size = 0;
  const std::uint8_t* data = av_stream_get_side_data(&stream, type, &size);
  return data && size >= least ? data : nullptr;
#endif
}

// Matroska: "00:00:05.040000000". The stream's own, where the container's is that of its longest stream.
double TaggedDuration_s(const AVStream& stream) {
  const AVDictionaryEntry* tag = av_dict_get(stream.metadata, "DURATION", nullptr, 0);
  int hours = 0, minutes = 0;
  double seconds = 0;
  if (!tag || std::sscanf(tag->value, "%d:%d:%lf", &hours, &minutes, &seconds) != 3) return 0;
  return hours * 3600.0 + minutes * 60.0 + seconds;
}

// Samples that an edit list leaves out are in the index, marked.
long ShownFrames(AVStream& stream, const AVInputFormat& format) {
  const std::string_view name = format.name ? format.name : "";
  const int entries = name.find("mp4") == name.npos ? 0 : avformat_index_get_entries_count(&stream);
  if (stream.nb_frames <= 0 || entries < stream.nb_frames) return static_cast<long>(stream.nb_frames);
  long shown = 0;
  for (int i = 0; i < entries; ++i)
    if (!(avformat_index_get_entry(&stream, i)->flags & AVINDEX_DISCARD_FRAME)) ++shown;
  return shown;
}

}  // namespace

Turn TurnOf(const std::int32_t* matrix) {
  Turn turn;
  if (!matrix) return turn;
  // x' = a x + c y, y' = b x + d y
  const double a = matrix[0], b = matrix[1], c = matrix[3], d = matrix[4];
  turn.transpose = std::abs(a) + std::abs(d) < std::abs(b) + std::abs(c);
  turn.flip_x = (turn.transpose ? c : a) < 0;
  turn.flip_y = (turn.transpose ? b : d) < 0;
  const double straight = turn.transpose ? std::abs(b) + std::abs(c) : std::abs(a) + std::abs(d);
  const double across = turn.transpose ? std::abs(a) + std::abs(d) : std::abs(b) + std::abs(c);
  turn.skew = across > kStraightTurn * straight;
  return turn;
}

Input::Input(const std::filesystem::path& path) : path_(path) {
  [[maybe_unused]] static const bool limited = (av_max_alloc(kMaxAllocation_bytes), true);
  KeepWords();
  ForgetWords();
  const auto refuse = [&](const std::string& why) {
    Close();
    throw InputError(path, why.empty() ? "is not a video that can be read" : "is not a video that can be read: " + why,
                     "was it cut off while being copied? ffmpeg -i may tell more");
  };
  file_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file_ < 0) {
    ThrowIfMachineIsShort(path, errno);
    refuse(std::strerror(errno));
  }
  format_ = avformat_alloc_context();
  io_ = avio_alloc_context(static_cast<unsigned char*>(av_malloc(kBufferBytes)), kBufferBytes, 0, &file_, ReadFile,
                           nullptr, SeekFile);
  format_->pb = io_;
  format_->io_open = OpenNothing;
  format_->flags |= AVFMT_FLAG_CUSTOM_IO;
  AVDictionary* options = nullptr;
  av_dict_set(&options, "protocol_whitelist", "none", 0);
  int error = avformat_open_input(&format_, "", nullptr, &options);  // frees format_ where it fails
  av_dict_free(&options);
  if (error >= 0) error = avformat_find_stream_info(format_, nullptr);
  if (error < 0) refuse(Words(error));
  const int best = av_find_best_stream(format_, AVMEDIA_TYPE_VIDEO, -1, -1, nullptr, 0);
  if (best < 0 || (format_->streams[best]->disposition & AV_DISPOSITION_ATTACHED_PIC)) refuse("it holds no video");
  video_ = format_->streams[best];
  const AVCodecParameters& codec = *video_->codecpar;
  if (codec.width <= 0 || codec.height <= 0) refuse("no size of its frames can be found");
  if (const auto* dovi = reinterpret_cast<const AVDOVIDecoderConfigurationRecord*>(
          SideData(*video_, AV_PKT_DATA_DOVI_CONF, sizeof(AVDOVIDecoderConfigurationRecord)));
      dovi && dovi->dv_profile == 5) {
    Close();
    throw InputError(path, "has Dolby Vision colours (profile 5), which cannot be decoded", "convert it to SDR first");
  }
  for (unsigned i = 0; i < format_->nb_streams; ++i)
    if (format_->streams[i] != video_) format_->streams[i]->discard = AVDISCARD_ALL;
}

Input::~Input() { Close(); }

void Input::Close() {
  avformat_close_input(&format_);
  if (io_) av_freep(&io_->buffer);
  avio_context_free(&io_);
  if (file_ >= 0) ::close(file_);
  file_ = -1;
}

double Input::Seconds(std::int64_t time_stamp) const {
  if (time_stamp == AV_NOPTS_VALUE) return std::numeric_limits<double>::quiet_NaN();
  return static_cast<double>(time_stamp) * av_q2d(video_->time_base);
}

bool Input::Read(AVPacket& packet) {
  for (;;) {
    av_packet_unref(&packet);
    if (av_read_frame(format_, &packet) < 0) return false;
    if (packet.stream_index == video_->index) return true;
  }
}

Turn Input::StatedTurn() const {
  return TurnOf(
      reinterpret_cast<const std::int32_t*>(SideData(*video_, AV_PKT_DATA_DISPLAYMATRIX, 9 * sizeof(std::int32_t))));
}

double Input::PixelAspect(AVFrame& frame) const {
  const AVRational aspect = av_guess_sample_aspect_ratio(format_, video_, &frame);
  return aspect.num > 0 && aspect.den > 0 ? av_q2d(aspect) : 1;
}

std::string Input::Comment() const {
  const AVDictionaryEntry* comment = av_dict_get(format_->metadata, "comment", nullptr, 0);
  return comment ? comment->value : "";
}

VideoClaims Input::Claims() const {
  VideoClaims claims;
  claims.average_fps = Rate(video_->avg_frame_rate);
  claims.nominal_fps = Rate(video_->r_frame_rate);
  if (claims.average_fps <= 0) claims.average_fps = claims.nominal_fps;
  claims.tick_s = av_q2d(video_->time_base);
  for (unsigned i = 0; i < format_->nb_streams; ++i)
    claims.has_sound |= format_->streams[i]->codecpar->codec_type == AVMEDIA_TYPE_AUDIO;
  claims.frames = ShownFrames(*video_, *format_->iformat);
  claims.counted = claims.frames > 0 && claims.frames < kMostFrames;
  if (claims.counted) return claims;
  double duration_s = TaggedDuration_s(*video_);
  if (duration_s <= 0) duration_s = Seconds(video_->duration);
  if (!(duration_s > 0) && format_->duration != AV_NOPTS_VALUE)
    duration_s = static_cast<double>(format_->duration) / AV_TIME_BASE;
  const double frames = std::round(duration_s * claims.average_fps);
  claims.frames = frames > 0 && frames < kMostFrames ? static_cast<long>(frames) : 0;
  if (duration_s > 0 && format_->duration_estimation_method == AVFMT_DURATION_FROM_STREAM)
    claims.duration_s = duration_s;
  return claims;
}

}  // namespace lumi::ffmpeg
