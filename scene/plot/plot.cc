#include "scene/plot/plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scene/program/printable.h"

namespace lumi {
namespace {

constexpr double kWidth = 640, kHeight = 460;
constexpr double kLeft = 66, kRight = 20, kTop = 58, kBottom = 96;
constexpr double kLabelHeight = 12, kCharacter = 5.6;  // of a label's font, pixels

// From values to pixels, with ticks at round values.
class Scale {
 public:
  Scale(const PlotAxis& axis, std::vector<double> values, double from_px, double to_px)
      : log_(axis.log), from_(from_px), to_(to_px) {
    std::erase_if(values, [&](double v) { return !std::isfinite(v) || (log_ && !(v > 0)); });
    if (values.empty()) values = {log_ ? 1.0 : 0.0, log_ ? 10.0 : 1.0};
    low_ = *std::min_element(values.begin(), values.end());
    high_ = *std::max_element(values.begin(), values.end());
    if (log_) {
      low_ = std::log10(low_);
      high_ = std::log10(high_);
    } else if (axis.zero) {
      low_ = std::min(low_, 0.0);
    }
    const double margin = high_ > low_ ? 0.06 * (high_ - low_) : log_ ? 0.5 : std::max(1e-9, 0.1 * std::abs(high_));
    if (log_ || !axis.zero) low_ -= margin;
    high_ += margin;
    MakeTicks();
  }
  bool Has(double v) const { return std::isfinite(v) && (!log_ || v > 0); }
  double operator()(double v) const {
    return from_ + (to_ - from_) * ((log_ ? std::log10(v) : v) - low_) / (high_ - low_);
  }
  const std::vector<double>& ticks() const { return ticks_; }

 private:
  void MakeTicks() {
    if (log_) {
      const bool few = high_ - low_ > 2.2;
      const bool many = high_ - low_ < 1.1;
      for (int e = static_cast<int>(std::floor(low_)); e <= static_cast<int>(std::ceil(high_)); ++e)
        for (const double m : many  ? std::vector<double>{1, 1.5, 2, 3, 5, 7}
                              : few ? std::vector<double>{1}
                                    : std::vector<double>{1, 2, 5}) {
          const double v = m * std::pow(10.0, e), l = std::log10(v);
          if (l >= low_ - 1e-9 && l <= high_ + 1e-9) ticks_.push_back(v);
        }
      return;
    }
    const double raw = (high_ - low_) / 6, power = std::pow(10.0, std::floor(std::log10(raw))), m = raw / power;
    const double step = power * (m < 1.5 ? 1 : m < 3.5 ? 2 : m < 7.5 ? 5 : 10);
    for (double v = std::ceil(low_ / step) * step; v <= high_ + 1e-9 * step; v += step)
      ticks_.push_back(std::abs(v) < 1e-9 * step ? 0 : v);
  }
  bool log_;
  double from_, to_, low_ = 0, high_ = 1;
  std::vector<double> ticks_;
};

struct Box {
  double x0, y0, x1, y1;
  bool Meets(const Box& o) const { return x0 < o.x1 && o.x0 < x1 && y0 < o.y1 && o.y0 < y1; }
};

std::string MarkerSvg(Marker marker, double x, double y, const std::string& color) {
  switch (marker) {
    case Marker::kCircle:
      return fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='4' fill='{}' fill-opacity='.75' stroke='{}'/>", x, y,
                         color, color);
    case Marker::kSquare:
      return fmt::format("<rect x='{:.1f}' y='{:.1f}' width='7' height='7' fill='{}' fill-opacity='.75' stroke='{}'/>",
                         x - 3.5, y - 3.5, color, color);
    case Marker::kDiamond:
      return fmt::format("<path d='M{:.1f} {:.1f}l5 5l-5 5l-5-5z' fill='{}' fill-opacity='.75' stroke='{}'/>", x, y - 5,
                         color, color);
    case Marker::kCross:
      return fmt::format("<path d='M{:.1f} {:.1f}l8 8m0-8l-8 8' stroke='{}' stroke-width='1.8' fill='none'/>", x - 4,
                         y - 4, color);
    default: return {};
  }
}

// In as many rows as it needs, `ly` the first one's.
std::string Legend(const Plot& plot, double x0, double x1, double ly) {
  std::string svg;
  double lx = x0;
  for (const PlotSeries& s : plot.series) {
    if (s.name.empty()) continue;
    const double w = 26 + 6.3 * static_cast<double>(s.name.size());
    if (lx + w > x1 && lx > x0) {
      lx = x0;
      ly += 17;
    }
    if (s.line)
      svg += fmt::format("<path d='M{:.1f} {:.1f}h16' stroke='{}' stroke-width='1.8'{}/>", lx, ly, s.color,
                         s.dashed ? " stroke-dasharray='5 4'" : "");
    svg += MarkerSvg(s.marker, lx + 8, ly, s.color);
    svg += fmt::format("<text x='{:.1f}' y='{:.1f}' class='tick'>{}</text>\n", lx + 20, ly + 4, Escaped(s.name));
    lx += w;
  }
  return svg;
}

std::string Panel(const Plot& plot, double offset_x, double offset_y) {
  std::vector<double> xs, ys;
  for (const PlotSeries& s : plot.series)
    for (const PlotPoint& p : s.points)
      if (std::isfinite(p.x) && std::isfinite(p.y) && (!plot.x.log || p.x > 0) && (!plot.y.log || p.y > 0)) {
        xs.push_back(p.x);
        ys.push_back(p.y);
      }
  const bool empty = xs.empty();
  const double x0 = kLeft, x1 = kWidth - kRight, y0 = kHeight - kBottom, y1 = kTop;
  const Scale sx(plot.x, xs, x0, x1), sy(plot.y, ys, y0, y1);
  std::string svg = fmt::format("<g transform='translate({:.0f} {:.0f})'>\n", offset_x, offset_y);
  svg += fmt::format("<text x='{}' y='24' class='title'>{}</text>\n<text x='{}' y='42' class='soft'>{}</text>\n", kLeft,
                     Escaped(plot.title), kLeft, Escaped(plot.subtitle));
  for (const double t : sx.ticks())
    svg += fmt::format(
        "<path d='M{0:.1f} {1}V{2}' class='grid'/><text x='{0:.1f}' y='{3}' class='tick' "
        "text-anchor='middle'>{4:g}</text>\n",
        sx(t), y1, y0, y0 + 17, t);
  for (const double t : sy.ticks())
    svg += fmt::format(
        "<path d='M{1} {0:.1f}H{2}' class='grid'/><text x='{3}' y='{4:.1f}' class='tick' "
        "text-anchor='end'>{5:g}</text>\n",
        sy(t), x0, x1, x0 - 7, sy(t) + 4, t);
  svg += fmt::format("<path d='M{} {}V{}H{}' class='axis'/>\n", x0, y1, y0, x1);
  svg += fmt::format("<text x='{}' y='{}' class='label' text-anchor='middle'>{}</text>\n", 0.5 * (x0 + x1), y0 + 36,
                     Escaped(plot.x.label));
  svg +=
      fmt::format("<text transform='translate(17 {:.1f}) rotate(-90)' class='label' text-anchor='middle'>{}</text>\n",
                  0.5 * (y0 + y1), Escaped(plot.y.label));
  if (empty)
    svg += fmt::format("<text x='{}' y='{}' class='soft' text-anchor='middle'>no measurement</text>\n", 0.5 * (x0 + x1),
                       0.5 * (y0 + y1));
  std::vector<Box> taken;
  for (const PlotMark& m : plot.marks) {
    if (!sx.Has(m.x)) continue;
    const double x = sx(m.x);
    if (x < x0 || x > x1) continue;
    svg += fmt::format("<path d='M{0:.1f} {1}V{2}' class='mark'/><text x='{3:.1f}' y='{4}' class='soft'>{5}</text>\n",
                       x, y1, y0, x + 4, y0 - 6, Escaped(m.label));
    taken.push_back({x, y0 - 18, x + 8 + kCharacter * static_cast<double>(m.label.size()), y0});
  }
  for (const PlotSeries& s : plot.series) {
    if (s.line) {
      std::string d;
      for (const PlotPoint& p : s.points) {
        if (!sx.Has(p.x) || !sy.Has(p.y)) continue;
        if (d.empty())
          d = fmt::format("M{:.1f} {:.1f}", sx(p.x), sy(p.y));
        else if (s.steps)
          d += fmt::format("H{:.1f}V{:.1f}", sx(p.x), sy(p.y));
        else
          d += fmt::format("L{:.1f} {:.1f}", sx(p.x), sy(p.y));
      }
      if (s.steps && !d.empty()) d += fmt::format("H{:.1f}", x1);
      svg += fmt::format("<path d='{}' fill='none' stroke='{}' stroke-width='1.8'{}/>\n", d, s.color,
                         s.dashed ? " stroke-dasharray='5 4'" : "");
    }
    for (const PlotPoint& p : s.points) {
      if (!sx.Has(p.x) || !sy.Has(p.y) || s.marker == Marker::kNone) continue;
      svg += fmt::format("<g>{}<title>{}</title></g>\n", MarkerSvg(s.marker, sx(p.x), sy(p.y), s.color),
                         Escaped(p.tip.empty() ? p.label : p.tip));
      taken.push_back({sx(p.x) - 4, sy(p.y) - 4, sx(p.x) + 4, sy(p.y) + 4});
    }
  }
  // A label is drawn right, left, above or below its point, where it covers no marker and no other label; else it is
  // left out, and only the tooltip shows it.
  for (const PlotSeries& s : plot.series)
    for (const PlotPoint& p : s.points) {
      if (p.label.empty() || !sx.Has(p.x) || !sy.Has(p.y)) continue;
      const double w = kCharacter * static_cast<double>(p.label.size()), h = kLabelHeight, x = sx(p.x), y = sy(p.y);
      const Box places[] = {{x - w - 8, y - h / 2, x - 8, y + h / 2},
                            {x + 8, y - h / 2, x + 8 + w, y + h / 2},
                            {x - w, y - h - 7, x, y - 7},
                            {x, y + 7, x + w, y + 7 + h},
                            {x - w / 2, y - h - 7, x + w / 2, y - 7},
                            {x - w / 2, y + 7, x + w / 2, y + 7 + h},
                            {x - w - 6, y - 2 * h - 8, x - 6, y - h - 8},
                            {x + 6, y + h + 8, x + 6 + w, y + 2 * h + 8}};
      for (const Box& b : places) {
        if (b.x0 < x0 + 2 || b.x1 > x1 || b.y0 < y1 || b.y1 > y0) continue;
        if (std::any_of(taken.begin(), taken.end(), [&](const Box& t) { return t.Meets(b); })) continue;
        svg += fmt::format("<text x='{:.1f}' y='{:.1f}' class='point'>{}</text>\n", b.x0, b.y1 - 2.5, Escaped(p.label));
        taken.push_back(b);
        break;
      }
    }
  return svg + Legend(plot, x0, x1, y0 + 58) + "</g>\n";
}

}  // namespace

std::string Escaped(const std::string& text) {
  std::string out;
  for (const char c : IsUtf8(text) ? text : Printable(text)) switch (c) {
      case '&': out += "&amp;"; break;
      case '<': out += "&lt;"; break;
      case '>': out += "&gt;"; break;
      case '\'': out += "&#39;"; break;
      case '"': out += "&quot;"; break;
      default: out += c;
    }
  return out;
}

std::string SvgOf(const std::vector<Plot>& panels, std::size_t columns) {
  const std::size_t count = std::max<std::size_t>(1, panels.size());
  columns = columns == 0 ? count : std::min(columns, count);
  const double width = kWidth * static_cast<double>(columns);
  const double height = kHeight * static_cast<double>((count + columns - 1) / columns);
  std::string svg = fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {0:g} {1:g}' width='{0:g}' height='{1:g}'>\n"
      "<style>text{{font-family:system-ui,'DejaVu "
      "Sans',Helvetica,Arial,sans-serif;fill:#24292f}}.title{{font-size:15px;font-weight:600}}"
      ".soft{{font-size:11px;fill:#6a737d}}.tick{{font-size:11px}}.label{{font-size:12px}}.point{{font-size:10px;fill:#"
      "444c56}}"
      ".grid{{stroke:#e4e7ea;fill:none}}.axis{{stroke:#57606a;fill:none}}.mark{{stroke:#9aa4ae;stroke-dasharray:2 "
      "3;fill:none}}</style>\n"
      "<rect width='100%' height='100%' fill='#ffffff'/>\n",
      width, height);
  for (std::size_t i = 0; i < panels.size(); ++i)
    svg += Panel(panels[i], kWidth * static_cast<double>(i % columns), kHeight * static_cast<double>(i / columns));
  return svg + "</svg>\n";
}

}  // namespace lumi
