// lumi-simulate: a ray-traced capture of a described scene, with ground truth.
#include "scene/program/main_program.h"
#include "simulate/capture.h"
#include "simulate/examples.h"

namespace {

std::string ExampleHelp() {
  std::string help = "A scene that comes with the program:";
  for (const lumi::Example& example : lumi::Examples()) help += "\n" + example.name + ": " + example.description;
  return help;
}

}  // namespace

int main(int argc, char** argv) {
  lumi::Program program("lumi-simulate",
                        "Makes photos of a described scene by ray tracing, with everything true about them beside");
  lumi::SimulateOptions options;
  lumi::Options& app = program.options();
  app.Add("SCENE", options.scene_file, "Scene described in JSON (see docs/simulate.md)");
  app.Add("--example", options.example, ExampleHelp());
  app.Add("-o,--output", options.output, "Folder of the capture: new, empty, or one made before with the same options")
      .Required();
  app.Flag("--replace", options.replace, "A capture in the folder that was made with other options is replaced");
  app.Add("--views", options.views, "So many photos, evenly spread over the path [default: all]").Positive();
  app.Add("--width", options.width_px, "Width of the photos in pixels, 1 to 20000 [default: as described]")
      .Range(1, 20000);
  app.Add("--fixed-frames", options.fixed_frames,
          "Frames of fixed.mp4 and of those in videos/, where the scene describes cameras on tripods; 0: no such video "
          "[default: as described]")
      .Range(0, 1000000);
  app.Add("--at", options.at_file,
          "Truth at any viewpoint and time: a camera path (JSON, as lumi-render reads it) whose keys "
          "are taken instead of the scene's path, "
          "without noise; a key may say \"phase\" for time_s");
  app.Flag("--video", options.video, "The photos also as video.mp4; --views N are then the first N frames");
  app.Add("--shake", options.shake,
          "So many times the shake of the scene's path; a drive without any is shaken like a walk; 0: none");
  app.Flag("--steady", options.steady,
           "The ideal path, truth for a stabilised video: without shake, rolling shutter and noise");
  app.Add("--blur-s", options.blur_s, "Motion blur: exposure time in seconds, 0: none [default: as described]");
  app.Add("--vignetting", options.vignetting,
          "Share of the light that the lens loses in the corners, 0 to 1 [default: as described]");
  app.Add("--white-balance-stops", options.white_balance_stops,
          "Drift of the white balance: amplitude, red up and blue down; 0: none [default: as described]");
  app.Add("--blur-every", options.blur_every,
          "Blurs one photo in so many, from the second one on; the others are sharp [default: as described]")
      .Positive();
  app.Add("--portrait-every", options.portrait_every,
          "Takes one photo in so many, from the second one on, with the camera turned by a quarter, as a phone held "
          "upright: its EXIF orientation is 6 [default: none]")
      .Positive();
  app.Examples(
      "lumi-simulate --example desk -o capture                      photos in capture/images, the truth in "
      "capture/truth\n"
      "lumi-simulate --example plaza --views 60 --width 640 -o plaza\n"
      "lumi-simulate --example hallway --video --shake 1.5 -o shaky");
  program.RunAndExit(argc, argv, [&] {
    options.seed = program.seed();
    return lumi::Simulate(options, program.progress());
  });
}
