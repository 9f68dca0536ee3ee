#include "stabilize/track_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

namespace lumi {
namespace {

constexpr int kColumns = 8, kRows = 5;  // of cells, the longest track of each
constexpr double kMargin = 0.25;        // of the picture, around it

}  // namespace

std::string TrackPlot(const FilmedScene& film, const std::vector<Matrix34d>& P,
                      const std::optional<Eigen::Vector3d>& focus_of_expansion_px,
                      const std::vector<std::int32_t>& fixed) {
  std::vector<std::vector<std::pair<std::size_t, Eigen::Vector2d>>> tracks(film.X.size());
  for (std::size_t t = 0; t < film.frames.size(); ++t)
    for (const SightOfPoint& s : film.frames[t].sights) tracks[static_cast<std::size_t>(s.point)].emplace_back(t, s.x);
  std::vector<std::size_t> order;
  const std::set<std::int32_t> stay(fixed.begin(), fixed.end());
  for (std::size_t j = 0; j < tracks.size(); ++j)
    if (tracks[j].size() >= 2) order.push_back(j);
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) { return tracks[a].size() > tracks[b].size(); });
  std::set<int> taken;
  std::erase_if(order, [&](std::size_t j) {
    const Eigen::Vector2d u = (tracks[j].front().second.cwiseQuotient(film.half()).array() + 1).matrix() / 2;
    const int column = std::clamp(static_cast<int>(kColumns * u.x()), 0, kColumns - 1),
              row = std::clamp(static_cast<int>(kRows * u.y()), 0, kRows - 1);
    return !taken.insert(row * kColumns + column).second && stay.count(static_cast<std::int32_t>(j)) == 0;
  });

  const double w = film.size_px.x(), h = film.size_px.y();
  const auto px = [&](const Eigen::Vector2d& x) {
    return Eigen::Vector2d(film.px_per_unit() * x + 0.5 * film.size_px.cast<double>());
  };
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"{:.0f} {:.0f} {:.0f} {:.0f}\" width=\"{:.0f}\" "
      "font-family=\"sans-serif\" font-size=\"12\">\n",
      -kMargin * w, -kMargin * h, (1 + 2 * kMargin) * w, (1 + 2 * kMargin) * h, std::min(1200.0, 1.5 * w));
  svg += fmt::format("<rect x=\"{:.0f}\" y=\"{:.0f}\" width=\"{:.0f}\" height=\"{:.0f}\" fill=\"white\"/>\n",
                     -kMargin * w, -kMargin * h, (1 + 2 * kMargin) * w, (1 + 2 * kMargin) * h);
  svg += fmt::format("<rect width=\"{:.0f}\" height=\"{:.0f}\" fill=\"#f4f4f4\" stroke=\"#999\"/>\n", w, h);
  for (const std::size_t j : order) {
    svg += "<polyline fill=\"none\" stroke=\"black\" stroke-width=\"0.6\" points=\"";
    for (const auto& [t, x] : tracks[j]) svg += fmt::format("{:.1f},{:.1f} ", px(x).x(), px(x).y());
    svg += "\"/>\n";
    for (const auto& [t, x] : tracks[j]) {
      const Eigen::Vector3d q = P[t] * film.X[j];
      if (!(q.z() > 1e-9)) continue;
      const Eigen::Vector2d y = px(q.head<2>() / q.z());
      if ((y.array() < -kMargin * film.size_px.cast<double>().array()).any() ||
          (y.array() > (1 + kMargin) * film.size_px.cast<double>().array()).any())
        continue;
      svg += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"1\" fill=\"#d1242f\"/>", y.x(), y.y());
    }
    if (stay.count(static_cast<std::int32_t>(j)) > 0) {
      const Eigen::Vector2d x = px(tracks[j].front().second);
      svg += fmt::format("<path d=\"M{0:.1f} {1:.1f}l8 8m0 -8l-8 8\" stroke=\"black\" stroke-width=\"2\"/>", x.x() - 4,
                         x.y() - 4);
    }
    svg += "\n";
  }
  if (focus_of_expansion_px) {
    const Eigen::Vector3d& e = *focus_of_expansion_px;
    const Eigen::Vector2d middle(0.5 * w, 0.5 * h);
    const Eigen::Vector2d towards = e.head<2>() - e.z() * middle;  // times e's w
    const double length = towards.norm(), least = std::abs(e.z()) * (0.5 + kMargin) * std::min(w, h);
    if (std::abs(e.z()) > 0 && length < least) {
      const Eigen::Vector2d c = e.hnormalized();
      svg += fmt::format(
          "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"9\" fill=\"none\" stroke=\"#1f6feb\" stroke-width=\"3\"/>\n", c.x(),
          c.y());
    } else if (length > 0) {
      const Eigen::Vector2d d = towards / length * (e.z() < 0 ? -1 : 1) * 0.45 * std::min(w, h);
      svg += fmt::format(
          "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"#1f6feb\" stroke-width=\"3\"/>"
          "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"5\" fill=\"#1f6feb\"/>\n",
          middle.x(), middle.y(), middle.x() + d.x(), middle.y() + d.y(), middle.x() + d.x(), middle.y() + d.y());
    }
  }
  svg += fmt::format(
      "<text x=\"{:.0f}\" y=\"{:.0f}\">black: as filmed; red: stabilised; blue: focus of expansion</text>\n</svg>\n",
      -kMargin * w + 10, -kMargin * h + 18);
  return svg;
}

}  // namespace lumi
