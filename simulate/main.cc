// lumi-simulate: a ray-traced capture of a described scene, with ground truth.
#include <nlohmann/json.hpp>

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
  program.app().add_option("SCENE", options.scene_file, "Scene described in JSON (see docs/simulate.md)");
  program.app().add_option("--example", options.example, ExampleHelp());
  program.app()
      .add_option("-o,--output", options.output, "Folder of the capture: new, empty, or a capture made before")
      ->required();
  program.app()
      .add_option("--views", options.views, "So many photos, evenly spread over the path [default: all]")
      ->check(CLI::PositiveNumber);
  program.app()
      .add_option("--width", options.width_px, "Width of the photos in pixels, 1 to 20000 [default: as described]")
      ->check(CLI::Range(1, 20000));
  program.app()
      .add_option("--fixed-frames", options.fixed_frames, "Frames of fixed.mp4 and of those in videos/, where the scene describes cameras on tripods; 0: no such video [default: as described]")
      ->check(CLI::Range(0, 1000000));
  program.app().add_option("--at", options.at_file,
                           "Truth at any viewpoint and time: a camera path (JSON, as lumi-render reads it) whose keys "
                           "are taken instead of the scene's path, "
                           "without noise; a key may say \"phase\" for time_s");
  program.app().add_flag("--video", options.video, "The photos also as video.mp4; --views N are then the first N frames");
  program.app().add_option_function<double>("--shake", [&](double scale) { options.shake = scale; },
                                            "So many times the shake of the scene's path; a drive without any is shaken like a walk; 0: none");
  program.app().add_flag("--steady", options.steady, "The ideal path, truth for a stabilised video: without shake, rolling shutter and noise");
  program.app().add_option_function<double>("--blur-s", [&](double seconds) { options.blur_s = seconds; },
                                            "Motion blur: exposure time in seconds, 0: none [default: as described]");
  program.app()
      .add_option("--blur-every", options.blur_every,
                  "Blurs one photo in so many, from the second one on; the others are sharp [default: as described]")
      ->check(CLI::PositiveNumber);
  return program.Run(
      argc, argv,
      [&] {
        options.seed = program.seed();
        return lumi::ToJson(options, lumi::Simulate(options, program.progress()));
      },
      [](const std::string& text) {
        const auto json = nlohmann::json::parse(text);
        const std::string output = json["output"];
        if (json["reused"]) return output + " holds this capture already";
        return std::to_string(json["views"].get<int>()) + " photos in " + output +
               "/images, what is true about them in " + output + "/truth";
      });
}
