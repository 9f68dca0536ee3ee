#include <fmt/format.h>

#include <charconv>

#include "pipeline/batch.h"
#include "pipeline/executor/slurm.h"
#include "pipeline/pipeline.h"
#include "pipeline/price.h"
#include "pipeline/stabilize/stabilize_video.h"
#include "scene/program/error.h"
#include "scene/program/main_program.h"

namespace lumi {
namespace {

void AddCameras(Options& app, PipelineOptions& options) {
  // lumi-reconstruct checks what it is given: these go to it as they are.
  app.Group("Cameras");
  const auto pass_option = [&](const std::string& name, const std::string& help) {
    app.Pass(name, options.reconstruct_arguments, help + " (as lumi-reconstruct)");
  };
  pass_option("--backend", "What finds the cameras");
  pass_option("--refine", "factorization: intrinsics that the last adjustment may move: auto, none, focal or centre");
  pass_option("--camera", "Known intrinsics, camera.yaml");
  app.Add("--calibration", options.calibration,
          "Photos or a video of a checkerboard taken by the same camera (lumi-calibrate finds its intrinsics), or a "
          "camera.yaml");
  app.Add("--board", options.board, "Inner corners of the checkerboard, columns x rows (as lumi-calibrate)");
  app.Add("--square-mm", options.square_mm, "Side of its squares (as lumi-calibrate)");
  pass_option("--masks", "Folder of NAME.png, black = ignore");
  pass_option("--database", "COLMAP database whose features and matches are reused");
  pass_option("--matching", "auto, exhaustive, similar or sequential");
  pass_option("--partners", "similar: photos that each is matched with first");
  pass_option("--mapper", "quick, careful or hierarchical");
  pass_option("--quality", "auto, low, medium or high");
  pass_option("--single-camera", "auto, yes or no");
  pass_option("--min-registered", "Fail unless this fraction of the photos gets a camera");
  pass_option("--keyframes", "Of a video; 0 = by parallax");
  pass_option("--component", "Which part of a scene that COLMAP split");
  pass_option("--poses", "File or model with known cameras");
  pass_option("--poses-format", "What its matrices are");
  pass_option("--pixel-origin", "Where its pixel (0, 0) is: corner or centre");
  pass_option("--focal-px", "Focal length, pixels");
  pass_option("--intrinsics", "fx,fy,cx,cy, pixels");
  pass_option("--rig", "Assume ring or grid");
  pass_option("--grid-size", "ROWSxCOLUMNS of --rig grid");
  pass_option("--grid-positions", "CSV of --rig grid");
  pass_option("--offsets-frames", "When each of several videos starts, in frames");
  pass_option("--times", "CSV: when each photo was taken");
  pass_option("--period-s", "Period of what the photos show, seconds");
  app.PassFlag("--turntable", options.reconstruct_arguments,
               "With --poses and --times: cameras about a turning object are put into the room (as lumi-reconstruct)");
  pass_option("--frame-step", "Every so many frames of several videos become views");
  app.Group("Time");
  app.Flag("--periodic", options.periodic,
           "INPUT is a video of a scene that repeats itself: its period is found, every frame gets a place in space "
           "and time");
  app.Add("--fixed-video", options.fixed_video, "With --periodic: the same scene from a tripod, to find the period in");
  app.Add("--period-frames", options.period_frames, "With --periodic: the period, in frames, where it is known");
  app.Group("Cameras");
  app.Flag("--rescale-cameras", options.rescale_cameras,
           "Scale given cameras to photos of another size instead of refusing");
  app.PassFlag("--clips", options.reconstruct_arguments,
               "INPUT is a folder of hand-held videos of one place, not taken at once (as lumi-reconstruct)");
  app.PassFlag("--all-frames", options.reconstruct_arguments,
               "A camera for every frame of a video (as lumi-reconstruct)");
}

void TakeHoldout(const std::string& text, PipelineOptions& options) {
  options.holdout_each = text == "each";
  if (options.holdout_each) return;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), options.holdout);
  if (error != std::errc() || end != text.data() + text.size())
    throw UsageError("takes a whole number, or each; not " + text);
}

// A video without its shake: another way through the same programs, to a video instead of a scene.
void AddStabilisation(Options& app, std::string& stabilize, StabilizeVideoOptions& steady) {
  app.Group("Stabilisation");
  app.Add("--stabilize", stabilize,
          "INPUT is a shaky video, -o OUT.mp4 its steady one: smooth, linear, vertigo or circular (as lumi-stabilize)")
      .OneOf({"smooth", "linear", "vertigo", "circular"});
  app.Add("--border", steady.border,
          "crop: until every picture is full; fill: the whole picture, its holes filled from frames farther away")
      .OneOf({"crop", "fill"})
      .Default();
  app.Add("--window-frames", steady.window_frames,
          "Frames that are reconstructed at once, 30 and more; 0: all up to 600, else 240, or 600 for linear, vertigo "
          "and circular")
      .Default();
  app.Add("--render-scale", steady.render_scale, "Size of the result over the video's, above 0, up to 4").Default();
  app.Add("--fps", steady.fps,
          "Frames a second of the result, above 0, up to 1000: each picture is the frame nearest in time; default: its "
          "frames have the video's own times");
  app.Flag("--split-screen", steady.split_screen, "Also OUT-split.mp4: left as filmed, right stabilised");
  app.Flag("--false-color", steady.false_color, "Also OUT-false-color.mp4: which frame each pixel is of");
  app.Flag("--no-score{false}", steady.score, "No comparison of input and output");
  app.Pass("--cutoff-hz", steady.path_arguments, "Movements of this frequency are halved (as lumi-stabilize)");
  app.Pass("--similar-hz", steady.path_arguments,
           "Stretch, shear and keystone are halved at this frequency (as lumi-stabilize)");
  app.Pass("--min-scale", steady.path_arguments, "Least share of the width that a crop may leave (as lumi-stabilize)");
  app.Pass("--iterations", steady.path_arguments, "Rounds for --min-scale's sake (as lumi-stabilize)");
  app.Pass("--object", steady.path_arguments, "vertigo: X,Y,WIDTH,HEIGHT of what stays (as lumi-stabilize)");
  app.Pass("--object-point", steady.path_arguments, "vertigo: X,Y of a track that stays (as lumi-stabilize)");
  app.Pass("--object-frame", steady.path_arguments,
           "vertigo: the film's frame that --object speaks of, from 0; shots without it are steadied by smooth");
  app.Pass("--k", steady.render_arguments, "Frames that a pixel blends (as lumi-render)");
  app.Pass("--render-window", steady.render_arguments,
           "Frames to either side that a picture may use (lumi-render's --window-frames)");
  app.Pass("--homographies", steady.reconstruct_arguments, "auto, always or never (as lumi-reconstruct)");
}

// --executor and what goes with it.
struct Where {
  std::string executor = "local";
  SlurmOptions slurm;
  std::filesystem::path batch;

  // nullptr: here.
  std::shared_ptr<lumi::Executor> Executor(int threads) {
    if (executor == "local") {
      if (!slurm.partition.empty() || !slurm.options.empty())
        throw UsageError(
            fmt::format("{} goes with --executor slurm", slurm.partition.empty() ? "--sbatch-option" : "--partition"));
      return nullptr;
    }
    slurm.cpus = threads;
    return MakeSlurmExecutor(slurm);
  }
};

}  // namespace
}  // namespace lumi

int main(int argc, char** argv) {
  using namespace lumi;
  Program program(
      "lumi-pipeline",
      "From a folder of photos or a video to a lumigraph with a report: cameras, proxy, evaluation on held-out photos, "
      "fly-through. A second run redoes only what changed.");
  PipelineOptions options;
  std::string stabilize;
  bool tradeoff = false, print_commands = false;
  Where where;
  StabilizeVideoOptions steady;
  Options& app = program.options();
  app.Add("INPUT", options.inputs,
          "Folder of photos, a video, a COLMAP workspace (images + sparse), transforms.json or a folder with one, or a "
          "scene. Several videos: hand-held clips of one place");
  app.Add("-o,--output", options.output, "Folder of the scene; may be left out where INPUT is a scene");
  app.Add("--proxy", options.proxy, "How the proxy is made")
      .OneOf({"auto", "plane", "planes", "box", "delaunay", "dense", "moving", "hull"})
      .Default();
  app.Add(
      "--proxy-minutes", options.proxy_minutes,
      "With --proxy auto, for depth maps of all photos, >= 0; 0: none; default: their size follows from the photos' "
      "number (lumi-proxy auto --help)");
  app.Add("--depth-width", options.depth_width_px,
          "With --proxy auto: longer side of the depth maps in pixels, 64..8192, instead of what follows from the "
          "photos or minutes");
  app.Add("--budget-ms", options.budget_ms,
          "With --proxy auto: the best proxy whose frames, 480 pixels wide, take at most so many milliseconds, > 0; "
          "default: the best");
  app.Add("--silhouette-rule", options.silhouette_rule,
          "The object's pixels, by a rule on colours: \"(B - R) < 25 && R + G + B > 60\" (as lumi-proxy silhouettes)");
  app.Add("--silhouettes", options.silhouettes, "Folder of the object's masks, white = object");
  app.Add("--silhouette-background", options.silhouette_background,
          "A photo of the background without the object, or a folder with one for each photo");
  app.Add("--faces", options.faces,
          "Simplify the proxy to so many faces; a hull stays around its silhouettes. 0 = as it is")
      .Default();
  app.Call(
         "--holdout", [&options](const std::string& text) { TakeHoldout(text, options); },
         "Every Nth photo is rendered from the others and compared; each = every photo in turn; 0 = no evaluation")
      .Default(std::to_string(options.holdout));
  app.Add("--render-backend", options.render_backend, "What renders").OneOf({"cpu", "gl"}).Default();
  app.Flag("--no-video{false}", options.video, "No fly-through");
  app.Flag("--no-fill{false}", options.video_fill, "What no photo sees stays black in the fly-through");
  app.Flag("--no-web{false}", options.web, "No page to walk in (SCENE/web.html)");
  app.Add("--web-mb", options.web_mb, "Most megabytes of that page, > 0 (as lumi-export web --max-mb)")
      .Positive()
      .Default();
  app.Add("--width", options.video_width_px, "Width of the fly-through, pixels, 16 to 16384").Default();
  app.Add("--seconds", options.video_seconds, "Length of the fly-through, seconds").Default();
  app.Add("--fidelity-db", options.video_fidelity_db,
          "How near the fly-through's frames, from sparse samples, are to a weight at every pixel (PSNR, as "
          "lumi-render); "
          "0 = a weight at every pixel")
      .Default();
  app.Flag("--print-commands", print_commands,
           "Runs, then prints the command of each stage: to run by hand, or with one of them exchanged");
  app.Group("Accuracy against time");
  app.Add(
      "--minutes", options.minutes,
      "The whole run keeps to so many, > 0: it chooses the cameras' quality by the number of photos, gives depth maps "
      "what is left, and leaves fly-through and page out where nothing is");
  app.Flag(
      "--tradeoff", tradeoff,
      "The pipeline at three to five qualities, OUT/draft to OUT/careful, minutes against the error of left-out "
      "photos and which stage takes most: table, OUT/tradeoff/pipeline.json, .csv and .svg; with --minutes until one "
      "takes longer. With --stabilize: the frames a picture may use, k, rounds of the path, size, least width and "
      "cutoffs against stability, kept area, distortion and seconds, on the first window: OUT-work/tradeoff.json "
      "and .svg");
  app.Group("Several machines, many captures");
  app.Add("--executor", where.executor, "Where stages run: here, or as jobs of a Slurm cluster")
      .OneOf({"local", "slurm"})
      .Default();
  app.Add("--partition", where.slurm.partition, "slurm: of the cluster; default: its own default");
  app.Add("--sbatch-option", where.slurm.options,
          "slurm: passed on to sbatch, as --sbatch-option=--time=60; may be given again")
      .OneEach();
  app.Add("--parts", options.parts,
          "slurm: depth maps as a job array of so many tasks, 1 to 1000, with --proxy auto or dense, and "
          "without --proxy-minutes")
      .Default();
  app.Add("--batch", where.batch,
          "A text file with an input a line: each becomes OUT/NAME with these options, one after the other, or all at "
          "once as jobs");
  AddCameras(app, options);
  AddStabilisation(app, stabilize, steady);

  app.Common({"--output", "--proxy", "--calibration", "--camera", "--poses", "--rig", "--focal-px", "--silhouette-rule",
              "--faces", "--holdout", "--quality", "--periodic", "--fixed-video", "--stabilize", "--minutes",
              "--tradeoff", "--no-video", "--no-web", "--print-commands"});
  app.Examples(
      "lumi-pipeline photos -o scene                            photos to walk in, with scene/report.html\n"
      "lumi-pipeline photos -o scene --minutes 20               in twenty minutes\n"
      "lumi-pipeline colmap-workspace -o scene                  with cameras that you have\n"
      "lumi-pipeline photos -o scene --rig ring --focal-px search --silhouette-rule '(B - R) < 25' --proxy hull\n"
      "lumi-pipeline lamp.mp4 -o scene --periodic               something that repeats itself\n"
      "lumi-pipeline shaky.mp4 -o steady.mp4 --stabilize smooth");
  const auto run = [&]() -> Answer {
    if (print_commands && (!where.batch.empty() || !stabilize.empty() || tradeoff))
      throw UsageError("--print-commands is of one scene: --batch, --stabilize and --tradeoff do not go with it");
    if (!where.batch.empty()) {
      if (options.parts > 1)
        throw UsageError("--batch makes each capture by one job, and --parts many jobs of one capture",
                         "run a large capture by itself");
      if (!options.inputs.empty())
        throw UsageError("--batch names the inputs, and INPUT is given as well", "give one of them");
      if (!stabilize.empty())
        throw UsageError("--batch makes scenes, and --stabilize a film", "run --stabilize once for each video");
      // Beside the batch's own files: OUT/NAME are scenes.
      where.slurm.folder = options.output / "jobs";
      return RunBatch(
          {where.batch, options.output, CaptureArguments({argv + 1, argv + argc}), where.Executor(program.threads())},
          program.progress());
    }
    if (options.inputs.empty())
      throw UsageError("INPUT is missing", "name a folder of photos, a video, a COLMAP workspace or a scene");
    options.input = options.inputs.front();
    if (options.inputs.size() > 1 && (options.periodic || !stabilize.empty()))
      throw UsageError(fmt::format("{} takes one video, and {} were given",
                                   options.periodic ? "--periodic" : "--stabilize", options.inputs.size()),
                       "run it once for each");
    if (!stabilize.empty()) {
      steady.input = options.input;
      steady.output = options.output;
      steady.model = stabilize;
      steady.threads = program.threads();
      where.slurm.folder = options.output.parent_path() / (options.output.stem().string() + "-work") / "jobs";
      steady.executor = where.Executor(program.threads());
      steady.seed = program.seed();
      steady.tradeoff = tradeoff;
      if (options.minutes) throw UsageError("--minutes is for a scene, and --stabilize makes a film");
      for (std::string& a : steady.render_arguments)
        if (a == "--render-window") a = "--window-frames";
      if (options.render_backend != "cpu")
        steady.render_arguments.insert(steady.render_arguments.end(), {"--backend", options.render_backend});
      return RunStabilizeVideo(steady, program.progress());
    }
    if (const std::vector<std::string> given = app.GivenOf("Stabilisation"); !given.empty())
      throw UsageError(given.front() + " goes with --stabilize");
    options.threads = program.threads();
    options.seed = program.seed();
    where.slurm.folder =
        (options.output.empty() ? options.input : options.output) / (tradeoff ? "tradeoff" : "provenance") / "jobs";
    options.executor = where.Executor(program.threads());
    if (tradeoff) return RunPipelinePrice(options, program.progress());
    const PipelineSummary summary = RunPipeline(options, program.progress());
    Answer answer(summary);
    if (print_commands) answer.text = answer.result = DescribeCommands(summary);
    return answer;
  };
  program.RunAndExit(argc, argv, [&] {
    try {
      return run();
    } catch (const Interrupted& e) {
      throw Error(e.code(), e.what(), {}, "the same command goes on from here");
    }
  });
}
