// lumi-stabilize: a steady path of projection matrices for a shaky video.
#include <map>

#include "scene/program/main_program.h"
#include "stabilize/commands.h"
#include "stabilize/score/score_command_line.h"

int main(int argc, char** argv) {
  lumi::Program program("lumi-stabilize", "A steady path of projection matrices for the video of a scene, metric or not");
  CLI::App& app = program.app();
  lumi::StabilizeCommandOptions o;
  lumi::StabilizeOptions& s = o.stabilize;
  app.add_option("SCENE", o.scene, "Scene of a video's frames (lumi-reconstruct VIDEO --backend factorization --projective --all-frames)");
  app.add_option("-o,--output", o.output, "PATH.json to write");
  app.add_option("--model", s.model, "Motion that the camera is given: smooth (what it did, without the shake), linear (constant velocity), vertigo (towards an object whose size stays), circular")
      ->transform(CLI::CheckedTransformer(std::map<std::string, lumi::MotionModel>{{"smooth", lumi::MotionModel::kSmooth},
                                                                                   {"linear", lumi::MotionModel::kLinear},
                                                                                   {"vertigo", lumi::MotionModel::kVertigo},
                                                                                   {"circular", lumi::MotionModel::kCircular}}));
  app.add_option("--cutoff-hz", s.cutoff_hz, "smooth: movements of this frequency are halved, faster ones removed, > 0")->capture_default_str();
  app.add_option("--similar-hz", s.similar_hz, "smooth: stretch, shear and keystone are halved at this frequency instead: slower ones are the scene's, > 0")->capture_default_str();
  app.add_option("--min-scale", s.min_scale, "No picture is to be cropped below this share of its width, 0.2 to 1: the path follows the camera more closely where it would be")->capture_default_str();
  app.add_option_function<int>(
         "--window", [&](int frames) { s.half_window = (frames - 1) / 2; }, "Frames around each that may fill its picture, odd [default: 11]")
      ->check(CLI::Range(1, 2001));
  app.add_option("--iterations", s.iterations, "Rounds in which the path is fitted again for --min-scale's sake; 0: none")->capture_default_str();
  app.add_option("--points", s.points, "Points of a frame that its matrix is fitted to, 8 and more")->capture_default_str();
  app.add_option_function<std::string>(
         "--border", [&](const std::string& b) { s.crop = b == "crop"; }, "crop: the path's pictures are zoomed until no border shows; fill: they are not, and the renderer fills [default: crop]")
      ->check(CLI::IsMember({"crop", "fill"}));
  app.add_option_function<double>("--fps", [&](const double& fps) { s.fps = fps; }, "Frames a second, where the scene has no times [default: 30]");
  app.add_option("--object", s.object_px, "vertigo: box X,Y,WIDTH,HEIGHT in pixels around the object that is to stay")->expected(4)->delimiter(',');
  app.add_option_function<std::vector<double>>(
         "--object-point",
         [&](const std::vector<double>& xy) {
           for (std::size_t i = 0; i + 1 < xy.size(); i += 2) s.object_points_px.emplace_back(xy[i], xy[i + 1]);
         },
         "vertigo, instead of a box: X,Y of a track on the object; may be given several times")
      ->type_size(2)
      ->delimiter(',');
  app.add_option("--object-frame", s.object_frame, "vertigo: frame that --object speaks of, from 0")->capture_default_str();
  app.add_option("--continue", o.before, "PATH.json of the window before this one: among the frames that both have, its path leads over to this one");
  app.add_option("--anchors", s.anchors, "Write what --continue needs of so many last frames: those that the next window has, too")->capture_default_str();
  app.add_option("--plot", o.plot, "SVG of the tracks before and after");
  lumi::score::ScoreCommandOptions score;
  lumi::score::AddScoreCommand(app, score);
  const CLI::App* scoring = app.get_subcommand("score");
  return program.Run(
      argc, argv,
      [&] {
        if (scoring->parsed()) return lumi::score::RunScore(score, program.progress());
        if (o.scene.empty() || o.output.empty()) throw lumi::UsageError("give SCENE and -o PATH.json", "see --help");
        return lumi::RunStabilize(o, program.progress());
      },
      [&](const std::string& json) { return scoring->parsed() ? lumi::score::DescribeScore(json) : lumi::DescribeStabilize(json); });
}
