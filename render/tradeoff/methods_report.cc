// Tables in Markdown of what `lumi-render methods` wrote.
#include <fmt/format.h>

#include <algorithm>

#include "render/tradeoff/methods.h"
#include "render/tradeoff/table_3_1.h"
#include "scene/files/atomic_file.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

// A method's row of a scene, as WriteTradeoff wrote it.
struct ReportedMethod {
  std::string method, chosen, refused;
  std::optional<double> psnr_seen_db, psnr_db, ssim, coverage, ms, ms_over_nearest;
};
void ListKeys(JsonKeys& j, ReportedMethod& m) {
  j("method", m.method, "chosen", m.chosen, "refused", m.refused, "psnr_seen_db", m.psnr_seen_db, "psnr_db", m.psnr_db,
    "ssim", m.ssim, "coverage", m.coverage, "ms", m.ms, "ms_over_nearest", m.ms_over_nearest);
}
struct ReportedScene {
  std::string scene, proxy, device;
  int width = 0, views = 0;
  double seen = 0;
  std::vector<ReportedMethod> methods;

  const ReportedMethod* Find(const std::string& name) const {
    const auto found = std::ranges::find(methods, name, &ReportedMethod::method);
    return found == methods.end() ? nullptr : &*found;
  }
};
void ListKeys(JsonKeys& j, ReportedScene& s) {
  j("scene", s.scene, "proxy", s.proxy, "device", s.device, "width", s.width, "views", s.views, "seen", s.seen,
    "methods", s.methods);
}

std::string FigureText(const std::optional<double>& value, const char* format) {
  return value ? fmt::format(fmt::runtime(format), *value) : std::string();
}

// The best PSNR of a scene: of this renderer's variants and of the other methods, and by how much one is ahead.
std::string AheadOf(const ReportedScene& scene) {
  const ReportedMethod *ours = nullptr, *theirs = nullptr;
  for (const ReportedMethod& m : scene.methods) {
    if (!m.psnr_seen_db) continue;
    const ReportedMethod*& best = m.method.starts_with("ulr") ? ours : theirs;
    if (!best || *m.psnr_seen_db > *best->psnr_seen_db) best = &m;
  }
  if (!ours || !theirs) return {};
  return fmt::format("{:+.2f} ({} to {})", *ours->psnr_seen_db - *theirs->psnr_seen_db, ours->method, theirs->method);
}

std::string ReportText(const std::vector<ReportedScene>& scenes) {
  std::vector<std::string> names{"nearest photo"};
  for (const std::string& name : MethodNames()) names.push_back(name);
  std::string text = "PSNR over seen pixels, dB\n\n| method |", rule = "|---|";
  for (const ReportedScene& s : scenes) {
    text += fmt::format(" {} |", s.scene);
    rule += "---|";
  }
  text += "\n" + rule + "\n";
  for (const std::string& name : names) {
    text += fmt::format("| {} |", name);
    for (const ReportedScene& s : scenes) {
      const ReportedMethod* m = s.Find(name);
      text += m && !m->refused.empty() ? " refused |"
                                       : fmt::format(" {} |", m ? FigureText(m->psnr_seen_db, "{:.2f}") : "");
    }
    text += "\n";
  }
  text += "| **ours ahead by** |";
  for (const ReportedScene& s : scenes) text += fmt::format(" {} |", AheadOf(s));
  for (const ReportedScene& s : scenes) {
    text += fmt::format(
        "\n\n**{}**: {} held-out photos, {} pixels wide, over {}; {:.1f} % of the pixels are seen by two photos. "
        "{}.\n\n"
        "| method | settings | seen dB | all dB | SSIM | covered | ms | x bare loop "
        "|\n|---|---|---|---|---|---|---|---|",
        s.scene, s.views, s.width, s.proxy, 100 * s.seen, s.device);
    for (const ReportedMethod& m : s.methods) {
      if (!m.refused.empty()) {
        text += fmt::format("\n| {} | refused: {} | | | | | | |", m.method, m.refused);
        continue;
      }
      const auto percent = m.coverage ? std::optional(100 * *m.coverage) : std::nullopt;
      text += fmt::format("\n| {} | {} | {} | {} | {} | {} | {} | {} |", m.method, m.chosen,
                          FigureText(m.psnr_seen_db, "{:.2f}"), FigureText(m.psnr_db, "{:.2f}"),
                          FigureText(m.ssim, "{:.3f}"), FigureText(percent, "{:.1f} %"), FigureText(m.ms, "{:.0f}"),
                          FigureText(m.ms_over_nearest, "{:.2f}"));
    }
  }
  return text + "\n";
}

// Each result's scene. Throws InputError where its list is empty.
template <typename Scene, typename Row>
std::vector<Scene> ReadAll(const TableOptions& o, std::vector<Row> Scene::*list, const char* what, const char* hint) {
  std::vector<Scene> scenes;
  for (const std::filesystem::path& file : o.results) {
    scenes.push_back(JsonKeys::Read(file, "a file of lumi-render methods").As<Scene>());
    if ((scenes.back().*list).empty()) throw InputError(file, fmt::format("has no {}", what), hint);
  }
  return scenes;
}

Answer Written(const TableOptions& o, std::size_t scenes, const std::string& text) {
  if (!o.output.empty()) WriteTextAtomically(o.output, text);
  JsonKeys keys;
  keys.Say("scenes", static_cast<int>(scenes)).Say("table", text);
  return {keys, text};
}

}  // namespace

Answer RunMethodsReport(const TableOptions& o) {
  const auto scenes =
      ReadAll(o, &ReportedScene::methods, "methods", "lumi-render methods SCENE -o OUT writes OUT/methods.json");
  return Written(o, scenes.size(), ReportText(scenes));
}

Answer RunTable(const TableOptions& o) {
  const auto scenes =
      ReadAll(o, &SceneFigures::properties, "properties", "lumi-render methods --properties measures them");
  return Written(o, scenes.size(), TableText(scenes));
}

}  // namespace lumi
