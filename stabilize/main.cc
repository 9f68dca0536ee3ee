// lumi-stabilize: stabilised videos, measured.
#include "scene/program/main_program.h"
#include "stabilize/score/score_command_line.h"

int main(int argc, char** argv) {
  lumi::Program program("lumi-stabilize", "Stabilised videos against their input");
  lumi::score::ScoreCommandOptions score;
  program.app().require_subcommand(1);
  lumi::score::AddScoreCommand(program.app(), score);
  return program.Run(argc, argv, [&] { return lumi::score::RunScore(score, program.progress()); }, lumi::score::DescribeScore);
}
