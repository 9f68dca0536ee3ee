// lumi-timeperiodic: a scene that repeats itself, placed in space and time.
#include "scene/program/main_program.h"
#include "timeperiodic/commands.h"

int main(int argc, char** argv) {
  lumi::Program program("lumi-timeperiodic", "The period of a scene that repeats itself, and its video placed in space and time");
  program.app().require_subcommand(1);

  lumi::PeriodCommandOptions period;
  CLI::App* p = program.app().add_subcommand("period", "The period of a video from a tripod, or, with --moving, from a camera that moves");
  p->add_option("VIDEO", period.video, "Video of some 10 to 20 periods")->required();
  p->add_flag("--moving", period.moving, "The camera moves: what stands still is aligned first");
  p->add_option("--frames", period.frames, "Two frames (from 0) that look alike, with --count periods between them, instead of a search")->expected(2);
  p->add_option("--count", period.count, "Periods between --frames, >= 1");
  p->add_option("--min-period", period.period.min_period, "Shortest period sought, frames, >= 2")->capture_default_str();
  p->add_option("--max-period", period.period.max_period, "Longest period sought, frames; 0 = as the video's length allows")->capture_default_str();
  p->add_option("--width", period.width_px, "Frames are looked at in this width, px, 16 to 4096")->check(CLI::Range(16, 4096))->capture_default_str();
  p->add_option("--plot", period.plot, "SVG of the video's likeness to itself and of the periods considered");

  return program.Run(
      argc, argv, [&] { return lumi::RunPeriod(period, program.progress()); }, lumi::DescribePeriod);
}
