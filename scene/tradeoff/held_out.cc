#include "scene/tradeoff/held_out.h"

#include <nlohmann/json.hpp>

#include "scene/program/error.h"
#include "scene/program/subprocess.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

nlohmann::json SummaryOf(const std::string& program, std::vector<std::string> arguments, const char* figure) {
  arguments.insert(arguments.begin(), SiblingProgram(program).string());
  arguments.push_back("--json");
  SubprocessOptions options;
  options.separate_stdout = true;
  const SubprocessResult result = RunSubprocess(arguments, options);
  nlohmann::json json = nlohmann::json::parse(result.out, nullptr, false);
  if (result.exit_code == static_cast<int>(ExitCode::kInterrupted)) throw Interrupted();
  if (result.exit_code != 0 || !json.is_object() || !json.contains(figure) || !json[figure].is_number()) {
    const bool said = json.is_object() && json.contains("error");
    const std::string why = said ? json["error"].value("message", "") : result.tail.empty() ? "" : result.tail.back();
    const bool ours = result.exit_code >= 1 && result.exit_code <= 4;
    throw Error(ours ? static_cast<ExitCode>(result.exit_code) : ExitCode::kMachine,
                program + " cannot measure it: " + why);
  }
  return json;
}

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
  auto json = SummaryOf("lumi-render",
                        {folder().string(), "-o", (frames / "frames").string(), "--proxy", proxy, "--holdout",
                         std::to_string(holdout_), "--fold", "choose", "--width", std::to_string(width_px_)},
                        "psnr_mean_db");
  return {json["psnr_mean_db"].get<double>(),
          json["ms_per_frame"].is_number() ? json["ms_per_frame"].get<double>() : 0};
}

void HeldOutBench::MakePlane() const { SummaryOf("lumi-proxy", {"plane", folder().string()}, "faces"); }

}  // namespace lumi
