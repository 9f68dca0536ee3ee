#include "pipeline/stabilize/film_output.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <optional>

#include "scene/files/atomic_file.h"
#include "scene/files/video_clock.h"
#include "scene/program/error.h"
#include "scene/program/subprocess.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

// As ffmpeg takes it whatever its name: "clip:1.mp4" is no protocol, "-x.mp4" no option.
std::string ForFfmpeg(const fs::path& file) { return "file:" + fs::absolute(file).string(); }

// Throws where the machine ended the program or its disk was full, which says nothing about the film. ffmpeg's own exit
// codes are the low bytes of its errors, and up to version 5 a film whose end could not be written is none: what it
// says counts.
void RequireNotEnded(const std::string& program, const SubprocessResult& result, const fs::path& film) {
  if (result.signal != 0) {
    const char* name = ::strsignal(result.signal);
    throw MachineError(fmt::format("{} was ended by signal {} ({})", program, result.signal, name ? name : "unknown"),
                       "a second run goes on from here", film);
  }
  const auto says = [&](const char* text) {
    return std::ranges::any_of(result.tail,
                               [&](const std::string& line) { return line.find(text) != std::string::npos; });
  };
  if (says("Too many packets buffered")) return;  // an error of the film, with the number of a full disk
  // Not EIO nor ENOMEM: with these ffmpeg also names a film that is cut off or damaged.
  for (const int error : {ENOSPC, EDQUOT, EFBIG})
    if (says(std::strerror(error)))
      throw MachineError(fmt::format("{} could not write it: {}", program, std::strerror(error)), "is the disk full?",
                         film);
}

// How long after the file's beginning its pictures begin: its sound may run before them. 0 where nobody says.
double PicturesBegin_s(const fs::path& video) {
  if (!FindProgram("ffprobe")) return 0;
  SubprocessOptions options;
  options.separate_stdout = true;
  const auto begin = [&](const std::string& what) {
    const SubprocessResult result = RunSubprocess({"ffprobe", "-v", "error", "-select_streams", "v:0", "-show_entries",
                                                   what + "=start_time", "-of", "csv=p=0", ForFfmpeg(video)},
                                                  options);
    RequireNotEnded("ffprobe", result, video);
    char* end = nullptr;
    const double seconds = std::strtod(result.out.c_str(), &end);
    return result.exit_code == 0 && end != result.out.c_str() && std::isfinite(seconds) ? std::optional(seconds)
                                                                                        : std::nullopt;
  };
  const auto pictures = begin("stream"), file = begin("format");
  return pictures && file ? std::max(0.0, *pictures - *file) : 0;
}

void WritePictures(const fs::path& silent, const Film& film, const std::string& task, ProgressSink& sink) {
  const std::vector<double>& times = film.time_s;
  const double fps = film.constant_fps.value_or(film.fps);
  const bool even = AreEven(times, fps);
  const std::vector<int> shown = film.constant_fps && !even ? ShownAtRate(times, FilmLength_s(times, film.fps), fps)
                                                            : std::vector<int>(times.size(), 1);
  VideoWriter writer(silent, fps);
  Progress progress(sink, task, static_cast<long>(times.size()));
  for (std::size_t i = 0; i < times.size(); ++i) {
    const Image8 picture = shown[i] > 0 ? film.frame(static_cast<int>(i)) : Image8();
    for (int k = 0; k < shown[i]; ++k) {
      if (even || film.constant_fps)
        writer.Add(picture);
      else
        writer.Add(picture, times[i] - times[0]);
    }
    progress.Step();
  }
  writer.Finish();
}

}  // namespace

bool WriteFilm(const fs::path& output, const Film& film, const std::string& task, ProgressSink& sink) {
  bool sound = false;
  RemoveStaleTemporariesOf(output);
  WriteFileAtomically(output, [&](const fs::path& temporary) {
    const fs::path silent = temporary.parent_path() / (temporary.stem().string() + "-silent.mp4");
    struct RemoveSilent {
      fs::path file;
      ~RemoveSilent() {
        std::error_code ignored;
        fs::remove(file, ignored);
      }
    } remove{silent};
    WritePictures(silent, film, task, sink);
    if (!film.sound_from.empty()) {
      const double before_s = PicturesBegin_s(film.sound_from),
                   length_s = FilmLength_s(film.time_s, film.fps) + before_s;
      for (const char* codec : {"copy", "aac"}) {
        std::vector<std::string> argv{"ffmpeg", "-v", "error", "-y", "-i", ForFfmpeg(silent)};
        // The sound ends with the film: ffmpeg's -shortest would end the film with the sound, since version 7 by
        // several frames.
        argv.insert(argv.end(), {"-t", fmt::format("{:.6f}", length_s)});
        if (before_s > 0) argv.insert(argv.end(), {"-itsoffset", fmt::format("{:.6f}", -before_s)});
        argv.insert(argv.end(), {"-i", ForFfmpeg(film.sound_from), "-map", "0:v:0", "-map", "1:a"});
        argv.insert(argv.end(), {"-c:v", "copy", "-c:a", codec, "-movflags", "+faststart"});
        argv.insert(argv.end(), {"-f", "mp4", ForFfmpeg(temporary)});
        const SubprocessResult result = RunSubprocess(argv);
        RequireNotEnded("ffmpeg", result, output);
        if (result.exit_code != 0) continue;
        std::error_code error;
        if (const auto bytes = fs::file_size(temporary, error); error || bytes == 0)
          throw MachineError("ffmpeg ended well and wrote nothing", "does the program ffmpeg in PATH work?", output);
        sound = true;
        return;
      }
    }
    fs::rename(silent, temporary);
  });
  return sound;
}

Image8 SplitScreen(const Image8& filmed, const Image8& steady) {
  Image8 split = steady;
  const int line = steady.width / 2;
  for (int y = 0; y < steady.height; ++y) {
    const int from_y = std::min(filmed.height - 1, y * filmed.height / steady.height);
    for (int x = 0; x < line; ++x) {
      const int from_x = std::min(filmed.width - 1, x * filmed.width / steady.width);
      for (int c = 0; c < steady.channels; ++c)
        split.At(x, y, c) = filmed.At(from_x, from_y, std::min(c, filmed.channels - 1));
    }
    for (int x = std::max(0, line - 1); x < std::min(steady.width, line + 1); ++x)
      for (int c = 0; c < steady.channels; ++c) split.At(x, y, c) = 255;
  }
  return split;
}

}  // namespace lumi
