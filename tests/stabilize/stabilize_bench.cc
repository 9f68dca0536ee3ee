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
    std::printf("%-34s %4zu %7.2f %9.4f  %5.3f %6.2f %7.1f %4d  %5.0f %6.0f\n", name, P.size(), JitterPx(walk, walk.shaky), JitterPx(walk, P), report.view_scale,
                report.model_rms_px, report.turn_deg, report.followed_frames, 1e3 * (read - begin), 1e3 * (end - read));
  } catch (const Error& e) {
    std::printf("%-34s %4zu %7.2f  %s\n", name, walk.ideal.size(), JitterPx(walk, walk.shaky), e.what());
  }
}

StabilizeOptions Of(MotionModel model, const Walk& walk = {}) {
  StabilizeOptions options;
  options.model = model;
  if (model == MotionModel::kVertigo && !walk.object.empty()) {
    const Matrix34d& P = walk.shaky.front();
    Eigen::Vector2d low = Eigen::Vector2d::Constant(1e9), high = -low;
    for (const std::int32_t j : walk.object) {
      const Eigen::Vector2d x = (P * walk.X[static_cast<std::size_t>(j)]).hnormalized();
      low = low.cwiseMin(x), high = high.cwiseMax(x);
    }
    low.array() -= 2, high.array() += 2;
    options.object_px = {low.x(), low.y(), (high - low).x(), (high - low).y()};
  }
  return options;
}

}  // namespace

int main(int argc, char**) {
  SetThreadCount(2);
  std::printf("%-34s %4s %7s %9s  %5s %6s %7s %4s  %5s %6s\n", "", "fr", "shaky", "result px", "scale", "rms", "turn", "fol", "read", "ms");
  Telling noisy;
  noisy.noise_px = 0.3;
  noisy.plane_tilt = {0.004, -0.003, 0.01};
  for (const int frames : {90, 300}) {
    if (argc > 1) break;
    const Walk forward = Forward(frames), sideways = Sideways(frames), diagonal = Diagonal(frames), wander = Wander(frames);
    Row("forward, linear", forward, Of(MotionModel::kLinear));
    Row("forward, linear, noise, plane off", forward, Of(MotionModel::kLinear), noisy);
    Row("sideways, linear", sideways, Of(MotionModel::kLinear));
    Row("sideways, linear, noise, plane off", sideways, Of(MotionModel::kLinear), noisy);
    Row("diagonal, linear", diagonal, Of(MotionModel::kLinear));
    Row("diagonal, linear, noise, plane off", diagonal, Of(MotionModel::kLinear), noisy);
    for (const double aside : {0.0, 1.2}) {
      const Walk vertigo = Vertigo(frames, aside);
      Row(aside > 0 ? "vertigo, object aside" : "vertigo", vertigo, Of(MotionModel::kVertigo, vertigo));
      Row(aside > 0 ? "vertigo, aside, noise, plane off" : "vertigo, noise, plane off", vertigo, Of(MotionModel::kVertigo, vertigo), noisy);
    }
    Row("forward, smooth", forward, Of(MotionModel::kSmooth));
    Row("sideways, smooth", sideways, Of(MotionModel::kSmooth));
    Row("wander, smooth", wander, Of(MotionModel::kSmooth));
    Row("wander, smooth, noise", wander, Of(MotionModel::kSmooth), noisy);
    Row("sideways, circular", sideways, Of(MotionModel::kCircular));
    Row("forward, circular", forward, Of(MotionModel::kCircular));
  }
  Row("sideways, still, circular", Sideways(90, kStill), Of(MotionModel::kCircular));
  for (const double arc : {5.0, 20.0}) Row(arc > 5 ? "circular 20, hardly shaky" : "circular 5, hardly shaky", Around(240, arc, {0.0005, 0.0005, 0, 0, 1}), Of(MotionModel::kCircular));
  for (const double arc : {1.0, 2.0, 5.0, 10.0, 20.0, 45.0, 90.0, 180.0, 270.0, 350.0}) {
    const Walk around = Around(240, arc);
    const std::string name = "circular " + std::to_string(static_cast<int>(arc));
    Row(name.c_str(), around, Of(MotionModel::kCircular));
    Row((name + ", noise, plane off").c_str(), around, Of(MotionModel::kCircular), [&] { Telling t = noisy; t.plane_tilt *= 2; return t; }());
  }
  (void)argc;
}
