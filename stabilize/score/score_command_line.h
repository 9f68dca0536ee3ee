// The subcommand, for main.cc.
#pragma once

#include <CLI/CLI.hpp>

#include "stabilize/score/score_command.h"

namespace lumi::score {

inline CLI::App* AddScoreCommand(CLI::App& app, ScoreCommandOptions& options) {
  CLI::App* command = app.add_subcommand("score", "Stabilised videos against their input: cropping, distortion, stability, jitter");
  command->add_option("INPUT", options.score.input, "The video as it was taken")->required();
  command->add_option("VIDEOS", options.score.stabilised, "Stabilised videos of the same frames, of any size");
  command->add_option("--plot", options.plot, "SVG of paths, spectra and jitter");
  return command;
}

}  // namespace lumi::score
