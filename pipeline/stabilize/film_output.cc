#include "pipeline/stabilize/film_output.h"

#include <fmt/format.h>

#include <algorithm>

#include "scene/files/atomic_file.h"
#include "scene/files/video.h"
#include "scene/program/error.h"
#include "scene/program/subprocess.h"

namespace lumi {
namespace fs = std::filesystem;

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
    {
      VideoWriter writer(silent, film.fps);
      Progress progress(sink, task, film.count);
      for (int i = 0; i < film.count; ++i) {
        writer.Add(film.frame(i));
        progress.Step();
      }
      writer.Finish();
    }
    if (!film.sound_from.empty())
      for (const char* codec : {"copy", "aac"}) {
        std::vector<std::string> argv{"ffmpeg", "-v", "error", "-y"};
        // The sound ends with the film: ffmpeg's -shortest would end the film with the sound, since version 7 by
        // several frames.
        argv.insert(argv.end(), {"-i", silent.string(), "-t", fmt::format("{:.6f}", film.count / film.fps)});
        argv.insert(argv.end(), {"-i", film.sound_from.string(), "-map", "0:v:0", "-map", "1:a"});
        argv.insert(argv.end(), {"-c:v", "copy", "-c:a", codec, "-movflags", "+faststart"});
        argv.insert(argv.end(), {"-f", "mp4", temporary.string()});
        const SubprocessResult result = RunSubprocess(argv);
        if (result.exit_code == 0) {
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
