// Small plots as SVG text: points, lines and labels on linear or logarithmic axes. Nothing is read or written here.
#pragma once

#include <string>
#include <vector>

namespace lumi {

struct PlotAxis {
  std::string label;  // with its unit
  bool log = false;   // values must be > 0: others are left out
  bool zero = false;  // begins at 0
};

struct PlotPoint {
  double x = 0, y = 0;
  std::string label;  // beside it, where there is room; empty: none
  std::string tip;    // shown when pointed at
};

enum class Marker { kCircle, kCross, kSquare, kDiamond, kNone };

struct PlotSeries {
  std::string name;   // in the legend; empty: not there
  std::string color;  // "#rrggbb"
  Marker marker = Marker::kCircle;
  bool line = false;
  bool steps = false;  // with `line`: horizontal, then vertical
  bool dashed = false;
  std::vector<PlotPoint> points;
};

struct PlotMark {  // a vertical line with a word at its top
  double x = 0;
  std::string label;
};

struct Plot {
  std::string title, subtitle;
  PlotAxis x, y;
  std::vector<PlotSeries> series;
  std::vector<PlotMark> marks;
};

// Panels, each 640 x 460, `columns` side by side; 0: all. A plot without a finite point says so in its frame.
std::string SvgOf(const std::vector<Plot>& panels, std::size_t columns = 0);

// Text with &, <, > and quotes escaped, for SVG and HTML; bytes that are no UTF-8 as \xHH.
std::string Escaped(const std::string& text);

}  // namespace lumi
