// Accuracy and time of the factorisation on simulated tracks of 100 frames: the figures of docs/factorization.md.
#include <cstdio>

#include "factorization_errors.h"
#include "scene/program/parallel.h"
#include "turning_scenes.h"

namespace {

using namespace lumi;
using namespace lumi::test;

void Row(const std::string& name, const SimulatedTracks& s, const FactorizationOptions& options) {
  long sights = 0;
  for (const Track& t : s.tracks.tracks) sights += static_cast<long>(t.observations.size());
  const FactorizationResult r = ReconstructFromTracks(s.tracks, s.camera, options, SilentProgress());
  double rotation = 0, centre = 0;
  if (r.upgrade == UpgradeKind::kMetric) {
    const TruthErrors errors = ErrorsAgainst(s, r);
    rotation = errors.rotation_max_deg;
    centre = 100 * errors.centre_max_share;
  }
  const StageSeconds& t = r.seconds;
  std::printf("%-28s %5zu %6ld  %-12s %3ld  %5.3f %5.3f  %6.3f %6.3f  %5.0f %5.0f %5.0f %5.0f %5.0f %6.0f\n",
              name.c_str(), s.tracks.tracks.size(), sights, std::string(Name(r.upgrade)).c_str(),
              static_cast<long>(std::count(r.placed.begin(), r.placed.end(), 1)), r.projective_rms_px, r.rms_px,
              rotation, centre, 1e3 * t.windows, 1e3 * t.merging, 1e3 * t.projective, 1e3 * t.upgrade, 1e3 * t.metric,
              1e3 * t.total);
}

// Homographies: px between where truth and result put a neighbour's and a far frame's pixels, rms.
void TurningRow(const char* name, const TurningOptions& options, std::size_t far) {
  const TurningVideo video = Turn(options);
  long sights = 0;
  for (const Track& t : video.sight.tracks.tracks) sights += static_cast<long>(t.observations.size());
  const FactorizationResult r = ReconstructByHomographies(video.sight.tracks, {}, SilentProgress());
  std::printf("%-28s %5zu %6ld  %5d  %6.3f %6.3f (%zu)  %5.3f %6.0f\n", name, video.sight.tracks.tracks.size(), sights,
              options.frames, TransferErrorPx(video, r, 1), TransferErrorPx(video, r, far), far, r.rms_px,
              1e3 * r.seconds.total);
}

}  // namespace

int main() {
  SetThreadCount(2);
  std::printf("%-28s %5s %6s  %-12s %3s  %5s %5s  %6s %6s  %5s %5s %5s %5s %5s %6s\n", "", "track", "sights", "upgrade",
              "cam", "rms P", "rms M", "deg", "%", "win", "merge", "proj", "upgr", "metr", "ms");
  const Noise noise = Tracked(0.3, 40);
  const SimulatedTracks plaza = See(PlazaPath(100), PlazaPoints(600), noise),
                        hallway = See(HallwayPath(100), HallwayPoints(600), noise),
                        desk = See(DeskPath(100), DeskPoints(300), noise),
                        round = See(DeskPath(100, 360), DeskPoints(300), noise);
  Row("plaza", plaza, {});
  Row("hallway", hallway, {});
  Row("desk", desk, {});
  Row("desk, full circle", round, {});
  Noise outliers = noise, missing = noise;
  outliers.outliers = 0.4;
  missing.missing = 0.7;
  Row("plaza, 40 % outliers", See(PlazaPath(100), PlazaPoints(600), outliers), {});
  Row("plaza, 70 % missing", See(PlazaPath(100), PlazaPoints(1200), missing), {});
  FactorizationOptions o;
  o.windows.length = 10;
  o.windows.overlap = 5;
  Row("plaza, windows of 10", plaza, o);
  o.windows.length = 40;
  o.windows.overlap = 20;
  Row("plaza, windows of 40", plaza, o);
  o = {};
  o.adjust_sights = 0;
  Row("plaza, all sights steer", plaza, o);
  o = {};
  o.adjust = false;
  Row("plaza, no adjustment", plaza, o);

  std::printf("\n%-28s %5s %6s  %5s  %6s %6s        %5s %6s\n", "Homographies", "track", "sights", "frame", "next",
              "far px", "rms", "ms");
  TurningOptions turning;
  turning.frames = 435;
  turning.points = 4500;
  turning.pan_deg = 120;
  TurningRow("pan of 120 degrees", turning, 60);
  TurningOptions changed = turning;
  changed.movers = 0.4;
  TurningRow("40 % of the tracks move", changed, 60);
  changed = turning;
  changed.track_frames = 15;
  TurningRow("tracks of half a second", changed, 60);
  changed = turning;
  changed.pan_deg = 40, changed.zoom = 2, changed.points = 1500;
  TurningRow("zoom by 2", changed, 200);
  changed = turning;
  changed.pan_deg = 0, changed.points = 1800;
  TurningRow("hand held, on the spot", changed, 200);
}
