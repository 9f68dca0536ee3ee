#include "scene/files/video.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <mutex>
#include <opencv2/core.hpp>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "scene/files/codecs.h"
#include "scene/files/file_name.h"
#include "scene/program/error.h"
#include "scene/program/interrupt.h"
#include "scene/program/subprocess.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

constexpr double kAssumedFps = 30;       // where a container states none
constexpr double kMaxFps = 1000;         // beyond: a container's time base, not its rate
constexpr double kHintTolerance = 0.01;  // of a count that a container computes from its duration

// MPEG elementary, program or transport stream, by its first bytes.
bool IsMpegStream(const fs::path& path) {
  char head[4] = {};
  std::ifstream(path, std::ios::binary).read(head, sizeof head);
  return (head[0] == 0 && head[1] == 0 && head[2] == 1) || head[0] == 0x47 ||
         (head[0] == 0 && head[1] == 0 && head[2] == 0 && head[3] == 1);
}

// OpenCV and FFmpeg would print; only programs do.
void SilenceDecoders() {
  static std::once_flag once;
  std::call_once(once, [] {
    ::setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0);
    cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  });
}

}  // namespace

bool HasVideoExtension(const fs::path& path) {
  static constexpr std::array kExtensions{".mp4", ".m4v",  ".mov", ".avi", ".mkv", ".webm", ".mpg", ".mpeg",
                                          ".mts", ".m2ts", ".ts",  ".wmv", ".3gp", ".ogv",  ".flv"};
  const std::string e = LowerExtension(path);
  return std::find(kExtensions.begin(), kExtensions.end(), e) != kExtensions.end();
}

struct VideoReader::Impl {
  fs::path path;
  std::unique_ptr<VideoDecoder> decoder;
  double fps = kAssumedFps;
  long hint = 0;
  bool hint_is_stated =
      false;  // by the container; MPEG streams have no such field, there it is a guess from the bit rate
  int width = 0, height = 0;
  int read = 0;
  bool ended = false;
  double last_time_s = -1;
  cv::Mat bgr;

  // Time of the frame just grabbed. The container's, where it says one and it increases (FFmpeg says 0 for the last
  // frames of many files); else by the frame rate.
  double FrameTime() {
    const double stated_s = decoder->TimeMs() / 1000.0;
    double time_s = stated_s;
    if (!std::isfinite(stated_s) || stated_s < 0 || stated_s <= last_time_s) {
      time_s = read / fps;
      if (time_s <= last_time_s) time_s = last_time_s + 1 / fps;
    }
    last_time_s = time_s;
    return time_s;
  }
};

VideoReader::VideoReader(const fs::path& path) : impl_(std::make_unique<Impl>()) {
  SilenceDecoders();
  Impl& v = *impl_;
  v.path = path;
  std::error_code error;
  if (!fs::exists(path, error)) throw InputError(path, "there is no such video");
  if (!fs::is_regular_file(path, error)) throw InputError(path, "is no video file");
  VideoClaims claims;
  try {
    // By its full path: a relative name such as "a%04d" or "rtsp:" would mean something else to the decoder.
    v.decoder = LoadCodecs().open_video(fs::absolute(path), &claims);
  } catch (const cv::Exception&) {
    throw InputError(path, "is not a video that can be read");
  }
  if (!v.decoder)
    throw InputError(path, "is not a video that can be read",
                     "was it cut off while being copied? ffmpeg -i may tell more");
  if (std::isfinite(claims.fps) && claims.fps > 0 && claims.fps <= kMaxFps) v.fps = claims.fps;
  if (std::isfinite(claims.frames) && claims.frames > 0 && claims.frames < 1e9)
    v.hint = static_cast<long>(claims.frames);
  v.hint_is_stated = !IsMpegStream(path);
  v.width = claims.width;
  v.height = claims.height;
}

VideoReader::~VideoReader() = default;

double VideoReader::fps() const { return impl_->fps; }
long VideoReader::frame_count_hint() const { return impl_->hint; }
int VideoReader::width() const { return impl_->width; }
int VideoReader::height() const { return impl_->height; }
int VideoReader::frames_read() const { return impl_->read; }
double VideoReader::time_s() const { return std::max(0.0, impl_->last_time_s); }
int VideoReader::times_made_up() const { return 0; }
std::vector<std::string> VideoReader::remarks() const { return {}; }

VideoTimes ReadVideoTimes(const fs::path& path) {
  VideoReader reader(path);
  VideoTimes times;
  times.fps = times.average_fps = reader.fps();
  while (reader.Skip()) times.time_s.push_back(reader.time_s());
  for (std::size_t i = 1; i < times.time_s.size(); ++i)
    times.largest_gap_s = std::max(times.largest_gap_s, times.time_s[i] - times.time_s[i - 1]);
  times.constant = times.largest_gap_s < 1.1 / times.fps;
  return times;
}

bool VideoReader::Skip() {
  Impl& v = *impl_;
  if (v.ended) return false;
  if (!v.decoder->Grab()) {
    v.ended = true;
    return false;
  }
  v.FrameTime();
  ++v.read;
  return true;
}

std::optional<VideoFrame> VideoReader::Next() {
  Impl& v = *impl_;
  if (v.ended) return std::nullopt;
  try {
    if (!v.decoder->Grab() || !v.decoder->Retrieve(v.bgr) || v.bgr.empty() || v.bgr.depth() != CV_8U) {
      v.ended = true;
      return std::nullopt;
    }
  } catch (const cv::Exception& e) {
    throw InputError(v.path, fmt::format("frame {} cannot be decoded: {}", v.read, e.err));
  }
  VideoFrame frame;
  frame.time_s = v.FrameTime();
  frame.index = v.read++;
  frame.rgb = Image8(v.bgr.cols, v.bgr.rows, 3);
  cv::Mat rgb(v.bgr.rows, v.bgr.cols, CV_8UC3, frame.rgb.data.data());
  cv::cvtColor(v.bgr, rgb,
               v.bgr.channels() == 1   ? cv::COLOR_GRAY2RGB
               : v.bgr.channels() == 4 ? cv::COLOR_BGRA2RGB
                                       : cv::COLOR_BGR2RGB);
  return frame;
}

bool VideoReader::truncated() const {
  const Impl& v = *impl_;
  const double slack = std::max(2.0, kHintTolerance * static_cast<double>(v.hint));
  return v.ended && v.hint_is_stated && v.hint > 0 && v.read + slack < static_cast<double>(v.hint);
}

struct VideoWriter::Impl {
  fs::path path, temporary;
  fs::path ffmpeg;
  double fps = 0;
  int width = 0, height = 0;  // of the frames, before padding
  pid_t child = -1;
  int to_child = -1;
  int log = -1;  // what ffmpeg said
  bool finished = false;

  void Start();
  void Send(const std::uint8_t* data, std::size_t size);
  int Wait();
  void Abandon();
  [[noreturn]] void Fail(const std::string& what);
};

void VideoWriter::Impl::Start() {
  const int padded_width = width + width % 2, padded_height = height + height % 2;
  // The matrix is stated (BT.601), so that players and decoders that assume one agree on the colours.
  std::vector<std::string> argv{ffmpeg.string(), "-nostdin", "-y", "-loglevel", "error"};
  argv.insert(argv.end(), {"-f", "rawvideo", "-pix_fmt", "rgb24", "-s"});
  argv.insert(argv.end(), {fmt::format("{}x{}", padded_width, padded_height), "-r", fmt::format("{}", fps)});
  argv.insert(argv.end(), {"-i", "pipe:0", "-an", "-c:v", "libx264", "-preset", "medium", "-crf", "18"});
  argv.insert(argv.end(), {"-pix_fmt", "yuv420p", "-colorspace", "smpte170m", "-color_primaries", "bt709"});
  argv.insert(argv.end(), {"-color_trc", "bt709", "-movflags", "+faststart", temporary.string()});
  std::vector<char*> arguments;
  for (std::string& a : argv) arguments.push_back(a.data());
  arguments.push_back(nullptr);
  // A socket pair rather than a pipe: writing to a child that has died is then an error code here (MSG_NOSIGNAL), with
  // no SIGPIPE for the whole program to ignore.
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
    throw MachineError(fmt::format("cannot start ffmpeg: {}", std::strerror(errno)));
  log = ::memfd_create("ffmpeg-log", MFD_CLOEXEC);
  const pid_t parent = ::getpid();
  child = ::fork();
  if (child == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(127);
    ::setpgid(0, 0);  // Ctrl-C is ours to handle: a half-written video is removed, not finished
    ::dup2(ends[0], STDIN_FILENO);
    const int null = ::open("/dev/null", O_WRONLY);
    ::dup2(null, STDOUT_FILENO);
    ::dup2(log >= 0 ? log : null, STDERR_FILENO);
    ::execv(arguments[0], arguments.data());
    ::_exit(127);
  }
  ::close(ends[0]);
  to_child = ends[1];
  if (child < 0) Fail(fmt::format("cannot start ffmpeg: {}", std::strerror(errno)));
}

void VideoWriter::Impl::Send(const std::uint8_t* data, std::size_t size) {
  while (size > 0) {
    const ssize_t n = ::send(to_child, data, size, MSG_NOSIGNAL);
    if (n < 0 && errno == EINTR) {
      CheckInterrupted();
      continue;
    }
    if (n < 0) Fail("cannot write the video");
    data += n;
    size -= static_cast<std::size_t>(n);
  }
}

int VideoWriter::Impl::Wait() {
  if (to_child >= 0) ::close(std::exchange(to_child, -1));
  int status = 0;
  while (child > 0 && ::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  child = -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

void VideoWriter::Impl::Abandon() {
  if (child > 0) {
    ::kill(child, SIGKILL);
    Wait();
  }
  if (to_child >= 0) ::close(std::exchange(to_child, -1));
  if (log >= 0) ::close(std::exchange(log, -1));
  std::error_code ignored;
  if (!temporary.empty()) fs::remove(temporary, ignored);
}

void VideoWriter::Impl::Fail(const std::string& what) {
  if (child > 0) Wait();
  std::string said(2000, '\0');
  const ssize_t n = log >= 0 ? ::pread(log, said.data(), said.size(), 0) : 0;
  said.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
  while (!said.empty() && std::isspace(static_cast<unsigned char>(said.back()))) said.pop_back();
  std::replace(said.begin(), said.end(), '\n', ';');
  Abandon();
  throw MachineError(said.empty() ? what : fmt::format("{}: {}", what, said),
                     "is the disk full, and does ffmpeg have libx264?", path);
}

VideoWriter::VideoWriter(const fs::path& path, double fps) : impl_(std::make_unique<Impl>()) {
  Impl& v = *impl_;
  if (!(fps > 0) || !(fps <= kMaxFps))
    throw UsageError(fmt::format("a video of {} frames a second cannot be written", fps));
  v.path = path;
  v.fps = fps;
  const auto ffmpeg = FindProgram("ffmpeg");
  if (!ffmpeg)
    throw MachineError("ffmpeg is needed to write a video and is not installed", "install the package ffmpeg", path);
  v.ffmpeg = fs::absolute(*ffmpeg);
  std::error_code error;
  if (path.has_parent_path()) fs::create_directories(path.parent_path(), error);
  if (error) throw MachineError(fmt::format("cannot be written: {}", error.message()), "choose another output", path);
  // The ending tells ffmpeg the container; an absolute path cannot be taken for an option or a protocol.
  v.temporary =
      fs::absolute(path.parent_path() / fmt::format(".{}.lumi-tmp-{}-v.mp4", path.stem().string(), ::getpid()));
}

VideoWriter::~VideoWriter() {
  if (!impl_->finished) impl_->Abandon();
}

void VideoWriter::Add(const Image8& rgb) {
  Impl& v = *impl_;
  if (rgb.channels != 3 || rgb.empty()) throw std::invalid_argument("VideoWriter: frames have 3 channels");
  if (v.child < 0 && v.width == 0) {
    v.width = rgb.width;
    v.height = rgb.height;
    v.Start();
  }
  if (v.child < 0) throw std::logic_error("VideoWriter: no frames after Finish or a failure");
  if (rgb.width != v.width || rgb.height != v.height) throw std::invalid_argument("VideoWriter: frames of one size");
  CheckInterrupted();
  if (rgb.width % 2 == 0 && rgb.height % 2 == 0) {
    v.Send(rgb.data.data(), rgb.data.size());
    return;
  }
  // The last column and row once more, where the size is odd: chroma is shared by 2 x 2 pixels.
  Image8 padded(rgb.width + rgb.width % 2, rgb.height + rgb.height % 2, 3);
  for (int y = 0; y < padded.height; ++y) {
    const std::uint8_t* from = rgb.Row(std::min(y, rgb.height - 1));
    std::copy(from, from + 3 * rgb.width, padded.Row(y));
    if (rgb.width % 2) std::copy(from + 3 * (rgb.width - 1), from + 3 * rgb.width, padded.Row(y) + 3 * rgb.width);
  }
  v.Send(padded.data.data(), padded.data.size());
}

void VideoWriter::Add(const Image8& rgb, double) { Add(rgb); }

void VideoWriter::Finish() {
  Impl& v = *impl_;
  if (v.finished) return;
  if (v.child < 0) throw MachineError("no frame was given: there is no video to write", {}, v.path);
  const int status = v.Wait();
  if (status != 0) v.Fail(fmt::format("ffmpeg ended with {}", status));
  std::error_code error;
  if (fs::file_size(v.temporary, error) == 0 || error) v.Fail("ffmpeg wrote nothing");
  fs::rename(v.temporary, v.path, error);
  if (error) v.Fail(fmt::format("cannot be written: {}", error.message()));
  v.finished = true;
  if (v.log >= 0) ::close(std::exchange(v.log, -1));
}

}  // namespace lumi
