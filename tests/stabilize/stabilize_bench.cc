// Accuracy and time of stabilisation on simulated walks: the figures of docs/stabilize.md.
#include <chrono>
#include <cstdio>

#include "scene/program/error.h"
#include "scene/program/parallel.h"
#include "stabilize/stabilize.h"
#include "tests/stabilize/walks.h"

namespace {

using namespace lumi;
using namespace lumi::test;

double Seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

void Row(const char* name, const Walk& walk, StabilizeOptions options, const Telling& telling = {}) {
  const double begin = Seconds();
  const FilmedScene film = ReadWalk(walk, telling);
  const double read = Seconds();
  StabilizeReport report;
  try {
    options.crop = false;
    const MatrixPath path = Stabilize(film, options, report, SilentProgress());
    const double end = Seconds();
    const std::vector<Matrix34d> P = InWalk(path, telling);
    std::printf("%-34s %4zu %7.2f %9.4f  %5.3f %6.2f %7.1f %4d  %5.0f %6.0f\n", name, P.size(),
                JitterPx(walk, walk.shaky), JitterPx(walk, P), report.view_scale, report.model_rms_px, report.turn_deg,
                report.followed_frames, 1e3 * (read - begin), 1e3 * (end - read));
  } catch (const Error& e) {
    std::printf("%-34s %4zu %7.2f  %s\n", name, walk.ideal.size(), JitterPx(walk, walk.shaky), e.what());
  }
}

// Windows against one: shake within a second of the seams, and the sharpest bend there.
void WindowsRow(const char* name, const Walk& walk, StabilizeOptions options, int length, int overlap,
                const Telling& telling = {}) {
  try {
    options.crop = false;
    StabilizeReport report;
    const std::vector<Matrix34d> alone =
        InWalk(Stabilize(ReadWalk(walk, telling), options, report, SilentProgress()), telling);
    const InWindows windows = StabilizeInWindows(walk, options, length, overlap, telling);
    double shake[2] = {0, 0}, bend[2] = {0, 0}, scale = 1;
    for (const int seam : windows.seams)
      for (int i = 0; i < 2; ++i) {
        shake[i] = std::max(shake[i], JitterPx(walk, i == 0 ? alone : windows.P, seam - 20, seam + overlap));
        bend[i] = std::max(bend[i], WorstBendPx(walk, i == 0 ? alone : windows.P, seam - 5, seam + overlap));
      }
    for (const StabilizeReport& r : windows.reports) scale = std::min(scale, r.view_scale);
    std::printf("| %s | %.4f | %.4f | %.4f | %.4f | %.4f | %.4f | %.3f | %.3f |\n", name, JitterPx(walk, alone),
                JitterPx(walk, windows.P), shake[0], shake[1], bend[0], bend[1], report.view_scale, scale);
  } catch (const Error& e) {
    std::printf("| %s | %s |\n", name, e.what());
  }
}

StabilizeOptions Of(MotionModel model, const Walk& walk = {}) {
  StabilizeOptions options;
  options.model = model;
  if (model == MotionModel::kVertigo && !walk.object.empty()) options.object_px = ObjectBox(walk);
  return options;
}

}  // namespace

int main() {
  SetThreadCount(2);
  std::printf(
      "\n## Seams between windows\n\n"
      "Windows of 240 frames, 90 of them shared, joined, against one window of 390 frames. Shake above 1 Hz, px of "
      "640x360, over all frames and around the worst seam; the sharpest bend there, px a frame a frame; the share of "
      "the width that every picture keeps.\n\n"
      "| walk, model | alone px | joined px | at the seam, alone px | joined px | bend alone | bend joined | width "
      "alone | width joined |\n|---|---|---|---|---|---|---|---|---|\n");
  for (const unsigned seed : {1U, 3U}) {
    Telling guessed;
    guessed.plane_tilt = {0.004, -0.003, 0.01};
    const Hand hand{0.014, 0.012, 0, 0, seed};
    WindowsRow("wander, smooth", Wander(390, hand), Of(MotionModel::kSmooth), 240, 90, guessed);
    WindowsRow("forward, smooth", Forward(390, hand), Of(MotionModel::kSmooth), 240, 90, guessed);
    WindowsRow("around, smooth", Around(390, 60, hand), Of(MotionModel::kSmooth), 240, 90, guessed);
    WindowsRow("sideways, linear", Sideways(390, hand), Of(MotionModel::kLinear), 240, 90, guessed);
    WindowsRow("forward, linear", Forward(390, hand), Of(MotionModel::kLinear), 240, 90, guessed);
    const Walk vertigo = Vertigo(390, 0, {0.01, 0.01, 0.006, 0, seed});
    WindowsRow("vertigo", vertigo, Of(MotionModel::kVertigo, vertigo), 240, 90, guessed);
    WindowsRow("circular", Around(390, 60, hand), Of(MotionModel::kCircular), 240, 90, guessed);
  }
  std::printf(
      "\n## Stabilisation of simulated walks\n\n```\n"
      "Shake above 1 Hz against the path that was meant, px of 640x360, before and after; the share of the width that "
      "every picture keeps; px rms that\n"
      "the video departs from the model; degrees around; frames that follow the camera for --min-scale; milliseconds "
      "to read and to find the path.\n"
      "%-34s %4s %7s %9s  %5s %6s %7s %4s  %5s %6s\n",
      "", "fr", "shaky", "result px", "scale", "rms", "turn", "fol", "read", "ms");
  Telling noisy;
  noisy.noise_px = 0.3;
  noisy.plane_tilt = {0.004, -0.003, 0.01};
  for (const int frames : {90, 300}) {
    const Walk forward = Forward(frames), sideways = Sideways(frames), diagonal = Diagonal(frames),
               wander = Wander(frames);
    Row("forward, linear", forward, Of(MotionModel::kLinear));
    Row("forward, linear, noise, plane off", forward, Of(MotionModel::kLinear), noisy);
    Row("sideways, linear", sideways, Of(MotionModel::kLinear));
    Row("sideways, linear, noise, plane off", sideways, Of(MotionModel::kLinear), noisy);
    Row("diagonal, linear", diagonal, Of(MotionModel::kLinear));
    Row("diagonal, linear, noise, plane off", diagonal, Of(MotionModel::kLinear), noisy);
    for (const double aside : {0.0, 1.2}) {
      const Walk vertigo = Vertigo(frames, aside);
      Row(aside > 0 ? "vertigo, object aside" : "vertigo", vertigo, Of(MotionModel::kVertigo, vertigo));
      Row(aside > 0 ? "vertigo, aside, noise, plane off" : "vertigo, noise, plane off", vertigo,
          Of(MotionModel::kVertigo, vertigo), noisy);
    }
    Row("forward, smooth", forward, Of(MotionModel::kSmooth));
    Row("forward, smooth, --min-scale 0.97", forward, [] {
      StabilizeOptions o = Of(MotionModel::kSmooth);
      o.min_scale = 0.97;
      return o;
    }());
    Row("sideways, smooth", sideways, Of(MotionModel::kSmooth));
    Row("wander, smooth", wander, Of(MotionModel::kSmooth));
    Row("wander, smooth, noise", wander, Of(MotionModel::kSmooth), noisy);
    Row("sideways, circular", sideways, Of(MotionModel::kCircular));
    Row("forward, circular", forward, Of(MotionModel::kCircular));
  }
  Row("sideways, still, circular", Sideways(90, kStill), Of(MotionModel::kCircular));
  for (const double arc : {5.0, 20.0})
    Row(arc > 5 ? "circular 20, hardly shaky" : "circular 5, hardly shaky", Around(240, arc, {0.0005, 0.0005, 0, 0, 1}),
        Of(MotionModel::kCircular));
  for (const double arc : {1.0, 2.0, 5.0, 10.0, 20.0, 45.0, 90.0, 180.0, 270.0, 350.0}) {
    const Walk around = Around(240, arc);
    const std::string name = "circular " + std::to_string(static_cast<int>(arc));
    Row(name.c_str(), around, Of(MotionModel::kCircular));
    Row((name + ", noise, plane off").c_str(), around, Of(MotionModel::kCircular), [&] {
      Telling t = noisy;
      t.plane_tilt *= 2;
      return t;
    }());
  }
  std::printf("```\n");
}
