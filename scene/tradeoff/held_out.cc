#include "scene/tradeoff/held_out.h"

#include "scene/program/error.h"
#include "scene/program/sibling.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

JsonKeys SummaryOf(const std::string& program, const std::vector<std::string>& arguments) {
  try {
    return RunSibling({program, arguments, {}, {}}, SilentProgress()).summary;
  } catch (const Interrupted&) {
    throw;
  } catch (const Error& e) {
    throw Error(e.code() == ExitCode::kBug ? ExitCode::kMachine : e.code(),
                program + " cannot measure it: " + e.what());
  }
}

struct Measured {
  std::optional<double> psnr_db;
  double ms_per_frame = 0;
};
void ListKeys(JsonKeys& j, Measured& m) { j("psnr_mean_db", m.psnr_db, "ms_per_frame", m.ms_per_frame); }

}  // namespace

HeldOutBench::HeldOutBench(const fs::path& scene_folder, int holdout, int width_px)
    : holdout_(holdout), width_px_(width_px) {
  fs::create_directory(copy_ / "proxies");
  for (const char* name : {"images", "masks", "sparse"})
    if (fs::exists(scene_folder / name)) fs::create_symlink(fs::absolute(scene_folder / name), copy_ / name);
  if (fs::exists(scene_folder / "lumigraph.json"))
    fs::copy_file(scene_folder / "lumigraph.json", copy_ / "lumigraph.json");
}

HeldOutBench::Figures HeldOutBench::Measure(const std::string& proxy) const {
  const TemporaryFolder frames;
  const auto measured =
      SummaryOf("lumi-render", {folder().string(), "-o", (frames / "frames").string(), "--proxy", proxy, "--holdout",
                                std::to_string(holdout_), "--fold", "choose", "--width", std::to_string(width_px_)})
          .As<Measured>();
  if (!measured.psnr_db) throw MachineError("lumi-render gave no error of the photos left out");
  return {*measured.psnr_db, measured.ms_per_frame};
}

void HeldOutBench::MakePlane() const { SummaryOf("lumi-proxy", {"plane", folder().string()}); }

}  // namespace lumi
