// lumi-stabilize: a steady path of projection matrices for a shaky video.
#include "scene/program/main_program.h"
#include "stabilize/commands.h"
#include "stabilize/score/score_command.h"

int main(int argc, char** argv) {
  lumi::Program program("lumi-stabilize",
                        "A steady path of projection matrices for the video of a scene, metric or not");
  lumi::Options& app = program.options();
  lumi::StabilizeCommandOptions o;
  lumi::StabilizeOptions& s = o.stabilize;
  app.Add("SCENE", o.scene,
          "Scene of a video's frames (lumi-reconstruct VIDEO --backend factorization --projective --all-frames)");
  app.Add("-o,--output", o.output, "PATH.json to write");
  app.Add("--model", s.model,
          "Motion that the camera is given: smooth (what it did, without the shake), linear (constant velocity), "
          "vertigo (towards an object whose size stays), circular",
          {{"smooth", lumi::MotionModel::kSmooth},
           {"linear", lumi::MotionModel::kLinear},
           {"vertigo", lumi::MotionModel::kVertigo},
           {"circular", lumi::MotionModel::kCircular}});
  app.Add("--cutoff-hz", s.cutoff_hz, "smooth: movements of this frequency are halved, faster ones removed, > 0")
      .Default();
  app.Add("--similar-hz", s.similar_hz,
          "smooth: stretch, shear and keystone are halved at this frequency instead: slower ones are the scene's, > 0")
      .Default();
  app.Add("--min-scale", s.min_scale,
          "No picture is to be cropped below this share of its width, 0.2 to 1: the path follows the camera more "
          "closely where it would be")
      .Default();
  app.Call(
         "--window",
         [&](int frames) {
           if (frames % 2 == 0)
             throw lumi::UsageError("takes an odd number (as many frames before as after), not " +
                                    std::to_string(frames));
           s.half_window = (frames - 1) / 2;
         },
         "Frames around each that may fill its picture, odd [default: 11]")
      .Range(1, 2001);
  app.Add("--iterations", s.iterations, "Rounds in which the path is fitted again for --min-scale's sake; 0: none")
      .Default();
  app.Add("--points", s.points, "Points of a frame that its matrix is fitted to, 8 and more").Default();
  app.Call(
         "--border", [&](const std::string& b) { s.crop = b == "crop"; },
         "crop: the path's pictures are zoomed until no border shows; fill: they are not, and the renderer fills "
         "[default: crop]")
      .OneOf({"crop", "fill"});
  app.Add("--fps", s.fps,
          "Frames a second, whatever times the scene has, above 0, up to 1000 [default: the scene's times; 30 without "
          "them]");
  app.Add("--object", s.object_px, "vertigo: box X,Y,WIDTH,HEIGHT in pixels around the object that is to stay")
      .Values(4)
      .Commas();
  std::vector<double> object_points_px;
  app.Add("--object-point", object_points_px,
          "vertigo, instead of a box: X,Y of a track on the object; may be given several times")
      .Pairs()
      .Commas();
  app.Add("--object-frame", s.object_frame, "vertigo: frame that --object speaks of, from 0").Default();
  app.Add("--continue", o.before,
          "PATH.json of the window before this one: among the frames that both have, its path leads over to this one");
  app.Add("--anchors", s.anchors,
          "Write what --continue needs of so many last frames: those that the next window has, too")
      .Default();
  app.Add("--plot", o.plot, "SVG of the tracks before and after");

  lumi::score::ScoreCommandOptions score;
  lumi::Options scoring =
      program.Command("score", "Stabilised videos against their input: cropping, distortion, stability, jitter",
                      [&] { return lumi::score::RunScore(score, program.progress()); });
  scoring.Add("INPUT", score.score.input, "The video as it was taken").Required();
  scoring.Add("VIDEOS", score.score.stabilised, "Stabilised videos of the same frames, of any size");
  scoring.Add("--plot", score.plot, "SVG of paths, spectra and jitter");
  app.Examples(
      "lumi-stabilize scene -o path.json --model smooth && lumi-render scene --path path.json -o steady.mp4\n"
      "lumi-stabilize score shaky.mp4 steady.mp4 other.mp4         how steady each is");
  program.RunAndExit(argc, argv, [&] {
    if (o.scene.empty() || o.output.empty()) throw lumi::UsageError("give SCENE and -o PATH.json", "see --help");
    for (std::size_t i = 0; i + 1 < object_points_px.size(); i += 2)
      s.object_points_px.emplace_back(object_points_px[i], object_points_px[i + 1]);
    return lumi::RunStabilize(o, program.progress());
  });
}
