#include "pipeline/stabilize/stabilize_video.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>

#include "pipeline/sibling_stage.h"
#include "pipeline/sibling_summaries.h"
#include "pipeline/stabilize/film_output.h"
#include "pipeline/stabilize/film_windows.h"
#include "pipeline/stabilize/score_rows.h"
#include "pipeline/stabilize/stabilize_report.h"
#include "pipeline/stabilize/stabilize_tradeoff.h"
#include "pipeline/stabilize/window_object.h"
#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/files/matrix_path.h"
#include "scene/files/provenance.h"
#include "scene/program/error.h"
#include "scene/program/interrupt.h"
#include "scene/program/stopwatch.h"
#include "scene/program/subprocess.h"
#include "scene/program/version.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

using Clock = std::chrono::steady_clock;

constexpr const char* kWeightsGrid = "25x25";
constexpr int kSmoothWindow = 240, kShotWindow = 600;   // frames reconstructed at once
constexpr double kOverlap_s = 3, kMostOverlap = 0.375;  // of two windows, and of a window's frames: a low-pass of 0.3
                                                        // Hz knows its way a second from its ends

// The programs run one after another, so that memory never exceeds this sum.
double PeakMemoryMb() {
  double sum = 0;
  for (const auto who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    struct rusage usage = {};
    if (::getrusage(who, &usage) == 0) sum += static_cast<double>(usage.ru_maxrss) / 1024;
  }
  return sum;
}

fs::path Beside(const fs::path& output, const char* what) {
  return output.parent_path() / (output.stem().string() + what);
}

struct Window {
  int begin = 0, end = 0;  // frames that it has, inclusive
  bool joined = false;     // goes on from the one before
  bool cut = false;        // a cut follows
  bool alone = false;      // one frame: nothing to stabilise
  int first_shown = 0;     // by this window, not by the one before
  fs::path folder;
  std::optional<sibling::PathSummary> path;
  std::string structure;
  double seconds = 0;
};

// What the windows depend on, in state.json.
struct Asked {
  std::string version, input, model;
  int window_frames = 0;
  std::vector<std::string> path, reconstruct;
  std::size_t seed = 0;
  bool operator==(const Asked&) const = default;
};
void ListKeys(JsonKeys& j, Asked& a) {
  j("version", a.version, "input", a.input, "model", a.model, "window_frames", a.window_frames, "path", a.path,
    "reconstruct", a.reconstruct, "seed", a.seed);
}
struct State {
  Asked wanted;
};
void ListKeys(JsonKeys& j, State& s) { j("wanted", s.wanted); }

// A window that is solved, in window.json: what it was made of, and what came of it.
struct WindowKey {
  int begin = 0, asked_end = 0;
  bool joined = false;
  std::string before;
  bool operator==(const WindowKey&) const = default;
};
void ListKeys(JsonKeys& j, WindowKey& k) {
  j("begin", k.begin, "asked_end", k.asked_end, "joined", k.joined, "before", k.before);
}
struct WindowRecord {
  WindowKey key;
  Window window;
};
void ListKeys(JsonKeys& j, WindowRecord& r) {
  Window& w = r.window;
  j("key", r.key, "end", w.end, "cut", w.cut, "structure", w.structure, "path", w.path, "first_shown", w.first_shown,
    "seconds", w.seconds);
}

template <typename T>
std::optional<T> ReadRecord(const fs::path& file, T record) {
  std::error_code ec;
  const auto json = fs::exists(file, ec) ? JsonKeys::Parse(ReadText(file)) : std::nullopt;
  return json && json->Into(record) ? std::optional(record) : std::nullopt;
}

class StabilizeRun {
 public:
  StabilizeRun(const StabilizeVideoOptions& options, ProgressSink& progress)
      : o_(options), progress_(progress), work_(Beside(options.output, "-work")) {}

  StabilizeVideoSummary Go() {
    const auto start = Clock::now();
    std::error_code ec;
    if (fs::equivalent(o_.input, o_.output, ec)) throw UsageError("the output is the input", "name another file");
    RequireOurFolder(work_, "state.json");
    RequireNoOtherFilms();
    facts_ = LookAtFilm(o_.input, progress_);
    if (o_.model == "vertigo") RequireObjectFrame(o_.path_arguments, static_cast<int>(facts_.time_s.size()));
    const FolderLock lock(work_);
    OpenState();
    MakeWindows();
    ChooseCrop();
    RenderWindows();
    WriteVideos();
    if (o_.score) Score();
    if (o_.tradeoff && !windows_.front().alone)
      summary_.tradeoff = MeasureStabilizeTradeoff(windows_.front().folder, work_, o_, facts_.fps, progress_).table;
    summary_.fps = o_.fps.value_or(facts_.fps);
    summary_.constant_rate = o_.fps || facts_.clock.constant();
    summary_.frames = frames_;
    summary_.border = o_.border;
    for (std::size_t i = 0; i < windows_.size(); ++i) summary_.windows.push_back(Reported(i));
    summary_.seconds = SecondsSince(start);
    summary_.peak_memory_mb = PeakMemoryMb();
    summary_.report = WriteStabilizeReport(work_, o_, summary_);
    return summary_;
  }

 private:
  std::vector<std::string> Common() const {
    return {"--threads", std::to_string(o_.threads), "--seed", std::to_string(o_.seed)};
  }

  StageResult Start(const std::string& name, const std::string& program, std::vector<std::string> arguments,
                    int number) {
    for (const std::string& a : Common()) arguments.push_back(a);
    return RunSiblingStage(
        {name, program, std::move(arguments), number, std::max(number, expected_windows_), o_.executor.get()},
        progress_);
  }

  // What an earlier run made for the same input and options stays; else the folder begins anew.
  void OpenState() {
    const State asked{{kVersion, Fingerprint(o_.input), o_.model, o_.window_frames, o_.path_arguments,
                       o_.reconstruct_arguments, o_.seed}};
    const fs::path file = work_ / "state.json";
    if (const auto state = ReadRecord<State>(file, {}); state && state->wanted == asked.wanted) return;
    for (const auto& entry : fs::directory_iterator(work_))
      if (entry.path().filename().string().starts_with("window-") && entry.is_directory()) fs::remove_all(entry.path());
    WriteTextAtomically(file, JsonKeys(asked).Text(1) + "\n");
  }

  int FramesExpected() const { return static_cast<int>(facts_.time_s.size()); }
  int WindowFrames() const {
    // A film that fits into one window has no seam, and its whole path is free.
    const int usual = o_.model == "smooth" && FramesExpected() > kShotWindow ? kSmoothWindow : kShotWindow;
    return o_.window_frames > 0 ? o_.window_frames : usual;
  }
  int MostOverlap() const { return static_cast<int>(kMostOverlap * WindowFrames()); }
  // How many frames a window that ends with frame `last` shares with the next one.
  int OverlapAt(int last) const {
    return std::max(2, std::min(FramesWithin(time_s_, last, kOverlap_s, 1 / facts_.fps), MostOverlap()));
  }

  void MakeWindows() {
    FilmFrames film(o_.input, facts_.clock);
    int length = WindowFrames();
    if (FramesExpected() > length) {
      // The same number of windows, but of one length: a short last window would see too few frames.
      const int overlap = std::max(2, std::min(static_cast<int>(std::lround(kOverlap_s * facts_.fps)), MostOverlap()));
      const int more = FramesExpected() - overlap;
      expected_windows_ = (more + length - overlap - 1) / (length - overlap);
      length = (more + expected_windows_ - 1) / expected_windows_ + overlap;
    }
    int begin = 0;
    bool joined = false;
    for (;;) {
      CheckInterrupted();
      Window window;
      window.begin = begin;
      window.joined = joined;
      window.folder = work_ / fmt::format("window-{:03d}", windows_.size());
      const int got = film.Write(begin, length, window.folder / "frames", progress_);
      time_s_ = film.time_s();
      if (windows_.empty() && got < 2)
        throw DataError(got == 0 ? "the video has no frame that can be read"
                                 : "the video has one frame: there is nothing to stabilise",
                        "a video of two frames or more", o_.input);
      window.end = begin + got - 1;
      window.first_shown = begin;
      const bool more = !film.AtEnd();
      if (!more) {  // what an earlier, longer run left behind does not belong to it
        std::error_code ec;
        for (const auto& entry : fs::directory_iterator(window.folder / "frames", ec))
          if (entry.path().filename().string() > FilmFrameName(window.end)) fs::remove(entry.path());
      }
      if (got == 1) {
        window.alone = true;
        window.structure = "none";
      } else {
        Solve(window, more);
      }
      frames_ = window.end + 1;
      joined = !window.cut;
      begin = window.cut ? window.end + 1 : window.end + 1 - OverlapAt(window.end);
      const bool last = !window.cut && !more;
      windows_.push_back(std::move(window));
      if (last) break;
    }
  }

  // When each frame of a window was taken, as lumi-reconstruct --times reads it.
  fs::path WriteTimes(const Window& window) const {
    std::string csv = "image,time_s,frame\n";
    for (int f = window.begin; f <= window.end; ++f)
      csv += fmt::format("{},{},{}\n", FilmFrameName(f), time_s_[static_cast<std::size_t>(f)], f);
    const fs::path file = window.folder / "times.csv";
    WriteTextAtomically(file, csv);
    return file;
  }

  // Cameras and path of a window; ends it where a cut is.
  void Solve(Window& window, bool more) {
    const int number = static_cast<int>(windows_.size()) + 1;
    const fs::path scene = window.folder / "scene", path = window.folder / "path.json",
                   record = window.folder / "window.json";
    std::error_code ec;
    std::string before;
    if (window.joined) before = Fingerprint(windows_.back().folder / "path.json");
    const WindowKey key{window.begin, window.end, window.joined, before};
    if (const auto known = ReadRecord<WindowRecord>(record, {{}, window});
        known && known->key == key && fs::exists(path, ec) && fs::exists(scene / "lumigraph.json", ec)) {
      window = known->window;
      return;
    }
    const auto start = Clock::now();
    std::vector<std::string> arguments{(window.folder / "frames").string(), "-o", scene.string()};
    arguments.insert(arguments.end(), {"--backend", "factorization", "--projective", "--matching", "sequential"});
    arguments.insert(arguments.end(), {"--times", WriteTimes(window).string()});
    arguments.insert(arguments.end(), o_.reconstruct_arguments.begin(), o_.reconstruct_arguments.end());
    const auto cameras = Start("cameras", "lumi-reconstruct", arguments, number).summary.As<sibling::CamerasSummary>();
    window.structure = cameras.structure;
    if (cameras.cut_frame) {
      window.cut = true;
      window.end = *cameras.cut_frame - 1;
    }
    if (window.end > window.begin) {
      FindPath(window, more && !window.cut, number);
    } else {
      window.alone = true;
      window.structure = "none";
    }
    fs::remove_all(scene / "colmap", ec);
    window.seconds = SecondsSince(start);
    if (window.alone) return;
    FlushToDisk(window.folder, {path});
    WriteTextAtomically(record, JsonKeys(WindowRecord{key, window}).Text(1) + "\n");
  }

  // A later window may not allow the model, or any path that continues the one before (an arc too short, nothing to be
  // seen). It then gets a smooth path, not joined if necessary, so that the film is made all the same.
  void FindPath(Window& window, bool goes_on, int number) {
    struct Way {
      std::string model;
      bool joined;
    };
    const bool keeps_object = window.joined && !ReadMatrixPath(windows_.back().folder / "path.json").object_px.empty();
    const auto object = ObjectArguments(o_.path_arguments, window.begin, window.end, keeps_object);
    const bool without_object = o_.model == "vertigo" && !object;
    if (without_object)
      progress_.Message(
          fmt::format("warning: frames {} to {}: the frame that --object speaks of (--object-frame) is "
                      "not among them; smooth instead",
                      window.begin, window.end));
    const std::string model = without_object ? "smooth" : o_.model;
    std::vector<Way> ways{{model, window.joined}};
    if (!windows_.empty() && model != "smooth") ways.push_back({"smooth", window.joined});
    if (window.joined) ways.push_back({"smooth", false});
    for (std::size_t i = 0;; ++i) {
      std::vector<std::string> arguments{(window.folder / "scene").string(), "--model", ways[i].model};
      arguments.insert(arguments.end(), {"-o", (window.folder / "path.json").string(), "--border", "fill"});
      arguments.insert(arguments.end(), {"--anchors", std::to_string(goes_on ? OverlapAt(window.end) : 0)});
      arguments.insert(arguments.end(), {"--plot", (window.folder / "tracks.svg").string()});
      if (ways[i].joined)
        arguments.insert(arguments.end(), {"--continue", (windows_.back().folder / "path.json").string()});
      const std::vector<std::string>& passed = ways[i].model == "vertigo" ? *object : o_.path_arguments;
      arguments.insert(arguments.end(), passed.begin(), passed.end());
      try {
        window.path = Start("path", "lumi-stabilize", arguments, number).summary.As<sibling::PathSummary>();
      } catch (const Error& e) {
        if (e.code() != ExitCode::kDataRefused || i + 1 == ways.size()) throw;
        progress_.Message(fmt::format("warning: frames {} to {}: {}; {}", window.begin, window.end, e.what(),
                                      ways[i + 1].joined || !window.joined
                                          ? "smooth instead"
                                          : "smooth instead, not joined to what came before"));
        continue;
      }
      if (ways[i].joined)
        window.first_shown = FrameOf(window.path->shown.at(0));
      else if (window.joined)
        window.first_shown = std::min(window.end, window.begin + OverlapAt(windows_.back().end) / 2);
      return;
    }
  }

  static int FrameOf(const std::string& name) { return std::stoi(name.substr(6, 6)); }

  void ChooseCrop() {
    if (o_.border == "fill") return;
    // Only of the frames that each window renders: beyond them, at its ends, it has fewer frames that could fill a
    // picture.
    for (std::size_t i = 0; i < windows_.size(); ++i) {
      if (windows_[i].alone) continue;
      const auto [first, last] = Rendered(i);
      for (const MatrixKey& key : ReadMatrixPath(windows_[i].folder / "path.json").keys)
        if (key.view >= FilmFrameName(first) && key.view <= FilmFrameName(last))
          summary_.kept_scale = std::min(summary_.kept_scale, key.view_scale);
    }
    if (summary_.kept_scale < 0.3)
      throw DataError(fmt::format("a steady picture that is full everywhere would keep {:.0f} % of the width",
                                  100 * summary_.kept_scale),
                      "--border fill keeps the whole picture, --min-scale lets the path follow the camera more "
                      "closely, --model smooth asks for less");
  }

  // A window renders up to where the next one shows what both have.
  std::pair<int, int> Rendered(std::size_t i) const {
    const bool goes_on = i + 1 < windows_.size() && windows_[i + 1].joined;
    return {windows_[i].first_shown, goes_on ? windows_[i + 1].first_shown - 1 : windows_[i].end};
  }

  void RenderWindows() {
    for (std::size_t i = 0; i < windows_.size(); ++i) {
      CheckInterrupted();
      if (windows_[i].alone) continue;
      const fs::path part = PathPart(i);
      Render(i, part, "steady", {});
      if (o_.false_color) Render(i, part, "false-color", {"--show", "false-color"});
    }
  }

  void Render(std::size_t i, const fs::path& path, const char* folder, std::vector<std::string> more) {
    const Window& window = windows_[i];
    std::vector<std::string> arguments{(window.folder / "scene").string(), "-o", (window.folder / folder).string()};
    arguments.insert(arguments.end(), {"--path", path.string(), "--proxy", "per-view"});
    const int width = 2 * static_cast<int>(0.5 * o_.render_scale * facts_.width_px + 0.5);
    if (o_.render_scale != 1) arguments.insert(arguments.end(), {"--width", std::to_string(std::max(16, width))});
    if (o_.border == "fill") arguments.insert(arguments.end(), {"--border", "fill"});
    // Weights of neighbouring pixels are alike: the same picture (75 dB) in a quarter of the time.
    if (more.empty()) arguments.insert(arguments.end(), {"--grid", kWeightsGrid});
    arguments.insert(arguments.end(), o_.render_arguments.begin(), o_.render_arguments.end());
    arguments.insert(arguments.end(), more.begin(), more.end());
    const StageResult stage = Start(std::string(folder) == "steady" ? "render" : "false colours", "lumi-render",
                                    arguments, static_cast<int>(i) + 1);
    windows_[i].seconds += stage.seconds;
    if (std::string(folder) == "steady")
      summary_.frames_reused += stage.summary.As<sibling::FramesSummary>().frames_reused;
  }

  // The frames that the window renders, zoomed to the crop of all.
  fs::path PathPart(std::size_t i) const {
    const Window& window = windows_[i];
    MatrixPath path = ReadMatrixPath(window.folder / "path.json");
    const auto [first, last] = Rendered(i);
    std::erase_if(path.keys, [&, begin = first, end = last](const MatrixKey& key) {
      return key.view < FilmFrameName(begin) || key.view > FilmFrameName(end);
    });
    const double scale = summary_.kept_scale;
    for (MatrixKey& key : path.keys) {
      key.anchors.clear();
      key.P.row(0) = key.P.row(0) / scale + (1 - 1 / scale) * 0.5 * path.width_px * key.P.row(2);
      key.P.row(1) = key.P.row(1) / scale + (1 - 1 / scale) * 0.5 * path.height_px * key.P.row(2);
    }
    path.cropped = true;
    const fs::path part = window.folder / "part.json";
    WriteMatrixPath(part, path);
    return part;
  }

  // Files of the result's frames in order; a frame that was not rendered stays as it was filmed.
  std::vector<fs::path> FramesOf(const char* folder) const {
    std::vector<fs::path> files(static_cast<std::size_t>(frames_));
    for (std::size_t i = 0; i < windows_.size(); ++i) {
      const auto [first, last] = Rendered(i);
      for (int f = first; f <= last; ++f)
        files[static_cast<std::size_t>(f)] = windows_[i].folder / "frames" / FilmFrameName(f);
      if (windows_[i].alone) continue;
      const std::vector<MatrixKey> keys = ReadMatrixPath(windows_[i].folder / "part.json").keys;
      std::vector<fs::path> rendered;
      for (const auto& entry : fs::directory_iterator(windows_[i].folder / folder / "frames"))
        if (entry.path().extension() == ".png" && entry.path().filename().string().starts_with("frame_"))
          rendered.push_back(entry.path());
      std::ranges::sort(rendered);
      if (rendered.size() < keys.size())
        throw Error(ExitCode::kBug, fmt::format("lumi-render left {} frames of {} in {}", rendered.size(), keys.size(),
                                                (windows_[i].folder / folder).string()));
      for (std::size_t k = 0; k < keys.size(); ++k)
        files[static_cast<std::size_t>(FrameOf(keys[k].view))] = rendered[k];
    }
    return files;
  }

  fs::path SplitScreenFile() const { return Beside(o_.output, "-split.mp4"); }
  fs::path FalseColorFile() const { return Beside(o_.output, "-false-color.mp4"); }
  // The names of these films follow from -o: the user has not seen them, and a film of that name may be another.
  void RequireNoOtherFilms() const {
    RequireOurFilm(o_.output);
    std::error_code error;
    if (fs::exists(work_ / "state.json", error)) return;
    for (const auto& [wanted, file] :
         {std::pair(o_.split_screen, SplitScreenFile()), std::pair(o_.false_color, FalseColorFile())})
      if (wanted && fs::exists(file, error))
        throw UsageError(fmt::format("{} is there and would be written: nothing was touched", file.string()),
                         "choose another -o, or move that film");
  }

  // The result's frames by their number, all of the first one's size.
  std::function<Image8(int)> Frames(const char* folder, const Eigen::Vector2i& size_px) const {
    return [files = FramesOf(folder), size_px](int i) {
      Image8 image = ReadImage8(files[static_cast<std::size_t>(i)]);
      return image.width == size_px.x() && image.height == size_px.y() ? image
                                                                       : Resize(image, size_px.x(), size_px.y());
    };
  }
  Eigen::Vector2i ResultSize_px() const {
    const ImageInfo first = ReadImageInfo(FramesOf("steady").front());
    return {first.width, first.height};
  }
  std::function<Image8(int)> Steadied() const { return Frames("steady", ResultSize_px()); }

  void WriteVideos() {
    const fs::path sound = facts_.sound ? o_.input : fs::path();
    const auto write = [&](const fs::path& output, const std::function<Image8(int)>& frame, const fs::path& sound_from,
                           const char* task) {
      const bool with_sound = WriteFilm(output, {facts_.fps, time_s_, frame, sound_from, o_.fps}, task, progress_);
      if (!sound_from.empty() && !with_sound)
        progress_.Message(fmt::format("warning: the sound could not be taken over into {}", output.string()));
      return with_sound;
    };
    const auto steadied = Steadied();
    summary_.sound = write(o_.output, steadied, sound, "writing video");
    summary_.video = o_.output;
    const auto filmed = [&](int i) {
      for (const Window& window : windows_)
        if (i >= window.begin && i <= window.end) return ReadImage8(window.folder / "frames" / FilmFrameName(i));
      return Image8();
    };
    if (o_.split_screen) {
      summary_.split_screen = SplitScreenFile();
      const auto both = [&](int i) { return SplitScreen(filmed(i), steadied(i)); };
      write(summary_.split_screen, both, sound, "writing split screen");
    }
    if (o_.false_color) {
      summary_.false_color = FalseColorFile();
      write(summary_.false_color, Frames("false-color", ResultSize_px()), {}, "writing false colours");
    }
  }

  // Frame by frame against the input's: of a film of another rate, its frames at their own times.
  void Score() {
    const int number = static_cast<int>(windows_.size());
    const bool other_frames = o_.fps && !AreEven(time_s_, *o_.fps);
    const fs::path scored = other_frames ? work_ / o_.output.filename() : o_.output;
    if (other_frames)
      WriteFilm(scored, {facts_.fps, time_s_, Steadied(), {}, {}}, "writing every frame for its figures", progress_);
    struct RemoveCopy {
      fs::path file;
      ~RemoveCopy() {
        std::error_code ignored;
        if (!file.empty()) fs::remove(file, ignored);
      }
    } remove{other_frames ? scored : fs::path()};
    try {
      summary_.score = Start("score", "lumi-stabilize", {"score", o_.input.string(), scored.string()}, number).summary;
    } catch (
        const Error& error) {  // a film of a white wall is made as well as it can be; nothing can be measured on it
      if (error.code() != ExitCode::kDataRefused) throw;
      progress_.Message(fmt::format("no figures for the result: {}", error.what()));
    }
  }

  StabilizedWindow Reported(std::size_t i) const {
    const Window& w = windows_[i];
    StabilizedWindow r;
    std::tie(r.first, r.last) = Rendered(i);
    r.begin = w.begin;
    r.end = w.end;
    r.structure = w.structure;
    r.seconds = w.seconds;
    r.cut = w.cut;
    if (w.path) {
      r.view_scale = w.path->view_scale;
      r.shake_before_px = w.path->shake_before_px;
      r.shake_after_px = w.path->shake_after_px;
      r.followed_frames = w.path->followed_frames;
      r.model = w.path->model;
    }
    return r;
  }

  const StabilizeVideoOptions& o_;
  ProgressSink& progress_;
  const fs::path work_;
  FilmFacts facts_;
  std::vector<double> time_s_;  // of the frames decoded so far
  std::vector<Window> windows_;
  int frames_ = 0;
  int expected_windows_ = 1;
  StabilizeVideoSummary summary_;
};

}  // namespace

std::string Validate(const StabilizeVideoOptions& o) {
  if (o.input.empty()) return "INPUT is missing";
  if (o.output.empty()) return "-o OUT.mp4 is missing";
  if (o.output.extension() != ".mp4" && o.output.extension() != ".MP4") return "--stabilize writes a video: -o OUT.mp4";
  if (o.window_frames != 0 && o.window_frames < 30) return "--window-frames is 0 (chosen) or at least 30";
  if (o.fps && !(*o.fps > 0 && *o.fps <= 1000)) return "--fps is above 0, up to 1000";
  if (!(o.render_scale > 0 && o.render_scale <= 4)) return "--render-scale is above 0, up to 4";
  return {};
}

StabilizeVideoSummary RunStabilizeVideo(const StabilizeVideoOptions& options, ProgressSink& progress) {
  if (const std::string wrong = Validate(options); !wrong.empty()) throw UsageError(wrong, "see --help");
  return StabilizeRun(options, progress).Go();
}

static void ListKeys(JsonKeys& j, StabilizedWindow& w) {
  j("first", w.first, "last", w.last).Say("reconstructed", std::array{w.begin, w.end});
  j("structure", w.structure, "model", w.model, "view_scale", w.view_scale);
  j("shake_before_px", w.shake_before_px, "shake_after_px", w.shake_after_px, "followed_frames", w.followed_frames,
    "cut", w.cut, "seconds", w.seconds);
}

void ListKeys(JsonKeys& j, StabilizeVideoSummary& s) {
  const auto written = [](const fs::path& file) { return file.empty() ? std::nullopt : std::optional(file); };
  j("video", s.video, "report", s.report)
      .Say("split_screen", written(s.split_screen))
      .Say("false_color", written(s.false_color));
  j("frames", s.frames, "frames_reused", s.frames_reused, "fps", s.fps, "constant_rate", s.constant_rate, "sound",
    s.sound, "border", s.border, "kept_scale", s.kept_scale);
  j.Say("kept_area", s.kept_scale * s.kept_scale);
  j("windows", s.windows, "score", s.score);
  if (s.tradeoff) j.Say("tradeoff", KeysOf(*s.tradeoff));
  j("peak_memory_mb", s.peak_memory_mb, "seconds", s.seconds);
}

std::string Describe(const StabilizeVideoSummary& s) {
  std::string text =
      fmt::format("{} frames in {} window{}, {:.1f} s, {:.1f} GB; {}{}\n", s.frames, s.windows.size(),
                  s.windows.size() == 1 ? "" : "s", s.seconds, s.peak_memory_mb / 1024,
                  s.border == "fill" ? "the whole picture, its borders filled"
                                     : fmt::format("cropped to {:.0f} % of the width", 100 * s.kept_scale),
                  s.sound ? ", with its sound" : "");
  for (const StabilizedWindow& w : s.windows)
    text += fmt::format("  {:6d} - {:<6d} {:<13} shake {:6.2f} -> {:5.2f} px{}{}\n", w.first, w.last, w.structure,
                        w.shake_before_px, w.shake_after_px,
                        w.followed_frames > 0 ? fmt::format(", {} frames follow the camera", w.followed_frames) : "",
                        w.cut ? ", a cut" : "");
  const auto score = s.score ? s.score->As<sibling::ScoreSummary>() : sibling::ScoreSummary();
  for (const ScoreRow& r : ScoreRows(score))
    text += fmt::format("  {:<24} cropping {}  distortion {}  stability {}  jitter {} px  kept area {}\n", r.video,
                        r.cropping, r.distortion, r.stability, r.jitter_px, r.kept_area);
  if (!score.remark.empty()) text += "  " + score.remark + "\n";
  if (s.tradeoff) text += "\n" + TextOf(*s.tradeoff) + "\n";
  text += "video:   " + s.video.string() + "\n";
  if (!s.split_screen.empty()) text += "split:   " + s.split_screen.string() + "\n";
  if (!s.false_color.empty()) text += "colours: " + s.false_color.string() + "\n";
  return text + "report:  " + s.report.string();
}

}  // namespace lumi
