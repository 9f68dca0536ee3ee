#include "render/show/legend.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "render/picture/source_color.h"

namespace lumi {
namespace {

constexpr double kLeastShare = 1e-3;                 // what is smaller does not show
constexpr int kRow = 22, kPatch = 16, kWidth = 420;  // units of the SVG

std::string ForXml(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    if (c == '&')
      safe += "&amp;";
    else if (c == '<')
      safe += "&lt;";
    else
      safe += static_cast<unsigned char>(c) < 0x20 ? '?' : c;
  }
  return safe;
}

}  // namespace

void ListKeys(JsonKeys& j, LegendEntry& e) { j("photo", e.photo, "color", e.color, "share", e.share); }

std::string FalseColorOf(int view) {
  const Eigen::Vector3f c = SourceColor(view);
  const auto code = [](float v) { return static_cast<int>(std::lround(255 * v)); };
  return fmt::format("#{:02x}{:02x}{:02x}", code(c.x()), code(c.y()), code(c.z()));
}

std::vector<LegendEntry> LegendOf(const Scene& scene, const ViewWeights& weights) {
  return LegendOf(scene, weights.Shares(scene.views.size()));
}

std::vector<LegendEntry> LegendOf(const Scene& scene, const std::vector<double>& shares) {
  std::vector<LegendEntry> legend;
  for (std::size_t i = 0; i < shares.size(); ++i)
    if (shares[i] >= kLeastShare) legend.push_back({scene.views[i].name, FalseColorOf(static_cast<int>(i)), shares[i]});
  std::ranges::stable_sort(legend, std::greater<>(), &LegendEntry::share);
  return legend;
}

std::string LegendSvg(const std::vector<LegendEntry>& legend) {
  const int height = kRow * static_cast<int>(legend.size() + 1) + 8;
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" "
      "font-family=\"sans-serif\" font-size=\"13\">\n<rect width=\"{0}\" height=\"{1}\" fill=\"white\"/>\n",
      kWidth, height);
  for (std::size_t i = 0; i < legend.size(); ++i) {
    const int y = 4 + kRow * static_cast<int>(i);
    svg += fmt::format(
        "<rect x=\"6\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"{}\"/><text x=\"30\" y=\"{}\">{}</text>"
        "<text x=\"{}\" y=\"{}\" text-anchor=\"end\">{:.1f} %</text>\n",
        y + 3, kPatch, kPatch, legend[i].color, y + kPatch, ForXml(legend[i].photo), kWidth - 8, y + kPatch,
        100 * legend[i].share);
  }
  return svg + fmt::format(
                   "<text x=\"6\" y=\"{}\" fill=\"#666\">Colours mix as the photos do; --k 1: one photo a "
                   "pixel.</text>\n</svg>\n",
                   4 + kRow * static_cast<int>(legend.size()) + kPatch);
}

}  // namespace lumi
