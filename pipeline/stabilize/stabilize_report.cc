#include "pipeline/stabilize/stabilize_report.h"

#include <fmt/format.h>

#include "pipeline/report/fronts.h"
#include "pipeline/report/html.h"
#include "pipeline/stabilize/score_rows.h"
#include "scene/files/atomic_file.h"

namespace lumi {
namespace fs = std::filesystem;

fs::path WriteStabilizeReport(const fs::path& folder, const StabilizeVideoOptions& options,
                              const StabilizeVideoSummary& s) {
  std::string cards =
      HtmlCard(std::to_string(s.frames), "frames",
               s.constant_rate ? fmt::format("{:.2f} a second", s.fps)
                               : fmt::format("at their own times, about {:.2f} a second", s.fps)) +
      HtmlCard(s.border == "fill" ? "filled" : fmt::format("{:.0f} %", 100 * s.kept_scale),
               s.border == "fill" ? "border" : "of the width kept",
               s.border == "fill" ? "holes come from frames farther away"
                                  : fmt::format("{:.0f} % of the area", 100 * s.kept_scale * s.kept_scale)) +
      HtmlCard(options.model, "motion model") + HtmlCard(s.sound ? "kept" : "none", "sound");
  std::vector<std::vector<std::string>> rows;
  for (const StabilizedWindow& w : s.windows)
    rows.push_back({fmt::format("{} - {}", w.first, w.last), fmt::format("{} - {}", w.begin, w.end),
                    EscapeHtml(w.structure), fmt::format("{:.2f}", w.shake_before_px),
                    fmt::format("{:.2f}", w.shake_after_px), fmt::format("{:.1f}", 100 * w.view_scale),
                    std::to_string(w.followed_frames), w.cut ? "a cut" : "", fmt::format("{:.1f}", w.seconds)});
  std::string body = cards + HtmlSection("Windows", HtmlTable({{"frames", false},
                                                               {"reconstructed from", false},
                                                               {"structure", false},
                                                               {"shake before, px", true},
                                                               {"after, px", true},
                                                               {"seen in every frame, % of width", true},
                                                               {"follow the camera", true},
                                                               {"ends with", false},
                                                               {"seconds", true}},
                                                              rows) +
                                                        "<p>Structure <em>homographies</em>: the camera only turned, "
                                                        "or saw one plane, or stood still. Shake: above 1 Hz.</p>");
  if (const std::vector<ScoreRow> scored =
          ScoreRows(s.score ? s.score->As<sibling::ScoreSummary>() : sibling::ScoreSummary());
      !scored.empty()) {
    rows.clear();
    for (const ScoreRow& r : scored)
      rows.push_back({EscapeHtml(r.video), r.cropping, r.distortion, r.stability, r.jitter_px, r.kept_area});
    body += HtmlSection("Score", HtmlTable({{"video", false},
                                            {"cropping ratio", true},
                                            {"distortion", true},
                                            {"stability", true},
                                            {"jitter, px", true},
                                            {"kept area", true}},
                                           rows) +
                                     "<p>" + EscapeHtml(s.score->As<sibling::ScoreSummary>().remark) + "</p>");
  }
  if (std::error_code ec; fs::exists(folder / "tradeoff.svg", ec) && s.tradeoff)
    body += HtmlSection("What the dials cost and give",
                        "<pre>" + EscapeHtml(TextOf(*s.tradeoff)) + "</pre>" + ReadText(folder / "tradeoff.svg"));
  // Of the first window, whose scene the dials were turned on.
  if (const std::string svg = FrontsSvg(folder / "window-000" / "scene", {}); !svg.empty())
    body += HtmlSection("What accuracy costs, stage by stage", svg);
  std::string tracks;
  for (std::size_t i = 0; i < s.windows.size() && i < 6; ++i) {
    const fs::path svg = folder / fmt::format("window-{:03d}", i) / "tracks.svg";
    std::error_code ec;
    if (fs::exists(svg, ec))
      tracks += fmt::format("<figure>{}<figcaption>frames {} to {}</figcaption></figure>", ReadText(svg),
                            s.windows[i].begin, s.windows[i].end);
  }
  if (!tracks.empty()) body += HtmlSection("Tracks", tracks);
  const fs::path page = folder / "report.html";
  WriteTextAtomically(page, HtmlPage("Stabilised: " + options.input.filename().string(), body));
  WriteTextAtomically(folder / "report.json", JsonKeys(s).Say("report", page).Text(1) + "\n");
  return page;
}

}  // namespace lumi
