// What docs/calibrate.md quotes of real boards: DIR/boards-stereo and DIR/boards-wide, done as their published fits
// were and at our defaults.
//
//   calibration_bench DIR
#include <cstdio>
#include <filesystem>

#include "calibrate/calibrate.h"
#include "scene/files/temporary_folder.h"
#include "scene/program/error.h"

namespace {

namespace fs = std::filesystem;
using namespace lumi;

struct Case {
  const char *photos, *folder, *prefix, *procedure;
  double reference_fx_px;
  CalibrateOptions options;
};

void Print(const Case& c, const fs::path& data) {
  const TemporaryFolder work;
  fs::create_directories(work / "photos");
  for (const fs::directory_entry& entry : fs::directory_iterator(data / c.folder))
    if (entry.path().filename().string().starts_with(c.prefix) && entry.path().extension() == ".jpg")
      fs::create_symlink(fs::absolute(entry.path()), work / "photos" / entry.path().filename());
  CalibrateOptions options = c.options;
  options.input = work / "photos";
  options.output = work / "camera.yaml";
  const CalibrateSummary s = Calibrate(options, SilentProgress());
  const Calibration& fit = s.fit.calibration;
  const double fx = fit.intrinsics[kFx];
  std::printf("| %s | %s | %s | %zu | %.2f +- %.2f | %.2f | %+.2f | %.3f | %.3f | %.1f |\n", c.photos, c.procedure,
              fit.model.name.c_str(), s.fit.views.size(), fx, s.fit.PixelSigmas().fx, c.reference_fx_px,
              100 * (fx / c.reference_fx_px - 1), fit.rms_px, s.fit.cross_validated_rms_px.value_or(-1), s.seconds);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "calibration_bench DIR\n"), 2;
  constexpr double kStereoFx = 535.92, kWideFx = 560.23;  // their own files
  CalibrateOptions ours, published_stereo, published_wide, wide;
  published_stereo.fit.model = "square-k1k2pk3";
  published_stereo.fit.fix_aspect = true;
  published_stereo.gather.corner_window_px = 11;
  published_wide.fit.model = "rect-k1k2pk3";
  published_wide.gather.corner_window_px = 5;
  published_stereo.fit.keep_outliers = published_wide.fit.keep_outliers = true;
  published_wide.board = wide.board = "8x6";
  try {
    std::printf(
        "| photos | procedure | model | views | fx px | published | off %% | RMS px | cross-validated px | seconds "
        "|\n|---|---|---|---|---|---|---|---|---|---|\n");
    for (const Case& c :
         {Case{"boards-stereo, left", "boards-stereo", "left", "as published", kStereoFx, published_stereo},
          Case{"boards-stereo, left", "boards-stereo", "left", "ours", kStereoFx, ours},
          Case{"boards-wide", "boards-wide", "", "as published", kWideFx, published_wide},
          Case{"boards-wide", "boards-wide", "", "ours", kWideFx, wide}})
      if (fs::exists(fs::path(argv[1]) / c.folder)) Print(c, argv[1]);
  } catch (const Error& e) {
    return std::fprintf(stderr, "calibration_bench: %s\n", e.what()), static_cast<int>(e.code());
  }
}
