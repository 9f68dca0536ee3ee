#include "proxy/hull/hull_tradeoff.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>

#include "scene/program/error.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace {

// What is to be measured.
std::vector<HullTradeoffRow> SettingsFor(std::size_t views, const HullOptions& options) {
  std::vector<HullTradeoffRow> rows{{"as given", "", views, 1, options.cell_px}};
  std::vector<std::size_t> counts;
  for (std::size_t n = 4; n < views; n *= 2) counts.push_back(n);
  counts.push_back(views);
  for (const std::size_t n : counts) {
    for (const int reduction : {1, 2, 4}) {
      if (n == views && reduction == 1) continue;
      std::string name = n == views ? fmt::format("all {} views", n) : fmt::format("{} views", n);
      if (reduction > 1) name += fmt::format(", silhouettes 1/{}", reduction);
      rows.push_back({name,
                      n == views       ? "silhouettes"
                      : reduction == 1 ? "views"
                                       : "several",
                      n, reduction, options.cell_px});
    }
  }
  for (const int wider : {2, 4})
    rows.push_back({fmt::format("all {} views, cell {:g} px", views, wider * options.cell_px), "cell", views, 1,
                    wider * options.cell_px});
  const bool tight = options.prefer == HullPreference::kTight;
  rows.push_back({tight ? "covering all silhouettes" : "tight", "prefer", views, 1, options.cell_px});
  return rows;
}

}  // namespace

std::vector<std::size_t> SpreadDirections(const std::vector<SilhouetteView>& views, const Eigen::Vector3d& object) {
  std::vector<Eigen::Vector3d> directions;
  for (const SilhouetteView& v : views) {
    const Eigen::Vector4d c = CentreOfProjection(v.P);
    directions.push_back((c.head<3>() - c.w() * object).normalized());
  }
  std::vector<std::size_t> order;
  std::vector<double> nearest(views.size(), -1);  // |cosine| of the angle to the nearest view that is chosen
  while (order.size() < views.size()) {
    std::size_t next = views.size();
    for (std::size_t v = 0; v < views.size(); ++v)
      if (nearest[v] <= 1 && (next == views.size() || nearest[v] < nearest[next])) next = v;
    order.push_back(next);
    nearest[next] = 2;
    for (std::size_t v = 0; v < views.size(); ++v)
      if (nearest[v] <= 1)
        nearest[v] = std::max(nearest[v], std::min(1.0, std::abs(directions[v].dot(directions[next]))));
  }
  return order;
}

SilhouetteView Reduced(const SilhouetteView& view, int reduction) {
  SilhouetteView out{
      view.name, view.P,
      Image8((view.mask.width + reduction - 1) / reduction, (view.mask.height + reduction - 1) / reduction, 1)};
  out.P.topRows<2>() /= reduction;
  for (int y = 0; y < view.mask.height; ++y) {
    for (int x = 0; x < view.mask.width; ++x)
      if (view.mask.At(x, y, 0) >= 128) out.mask.At(x / reduction, y / reduction, 0) = 255;
  }
  return out;
}

std::vector<HullTradeoffRow> MeasureHullTradeoff(const std::vector<SilhouetteView>& views, const HullOptions& options,
                                                 ProgressSink& progress, const std::optional<Eigen::Vector3d>& near) {
  std::vector<SilhouetteView> spread = views, whole;
  for (const SilhouetteView& v : views) {
    const std::size_t object = CountObject(v.mask);
    if (object > 0 && object < v.mask.data.size()) whole.push_back(v);
  }
  std::vector<HullTradeoffRow> rows = SettingsFor(whole.size(), options);
  Progress steps(progress, "hulls", static_cast<long>(rows.size()));
  for (HullTradeoffRow& row : rows) {
    const bool first = &row == &rows.front();
    HullOptions o = options;
    o.cell_px = row.cell_px;
    if (row.line == "prefer")
      o.prefer = options.prefer == HullPreference::kTight ? HullPreference::kCover : HullPreference::kTight;
    if (o.dilation_px) *o.dilation_px /= row.reduction;
    o.max_dilation_px = std::max(0.5, o.max_dilation_px / row.reduction);
    std::vector<SilhouetteView> offered;
    for (std::size_t n = 0; n < row.views; ++n)
      offered.push_back(row.reduction == 1 ? spread[n] : Reduced(spread[n], row.reduction));
    const auto start = std::chrono::steady_clock::now();
    try {
      HullSummary s;
      const Mesh mesh = BuildVisualHull(first ? whole : offered, o, SilentProgress(), &s, near);
      row.seconds = SecondsSince(start);
      const SilhouetteFitSummary fit = Summarize(MeasureSilhouettes(mesh, whole));
      row.used = s.used.size();
      row.faces = mesh.faces.size();
      row.dilation_px = s.dilation_px * row.reduction;
      row.iou_median = fit.iou_median;
      row.iou_min = fit.iou_min;
      row.coverage_min = fit.coverage_min;
      row.volume = s.volume;
      if (first) {
        Eigen::Vector3d middle = Eigen::Vector3d::Zero();
        for (const Eigen::Vector3d& x : mesh.vertices) middle += x / static_cast<double>(mesh.vertices.size());
        std::vector<SilhouetteView> trusted;
        // Of the views that agree; the others last.
        for (const bool agrees : {true, false}) {
          std::vector<SilhouetteView> some;
          for (const SilhouetteView& v : whole)
            if ((std::ranges::find(s.used, v.name) != s.used.end()) == agrees) some.push_back(v);
          for (const std::size_t n : SpreadDirections(some, middle)) trusted.push_back(some[n]);
        }
        spread = std::move(trusted);
      }
    } catch (const DataError& e) {
      if (first) throw;
      row.seconds = SecondsSince(start);
      row.failed = e.what();
    }
    steps.Step();
  }
  return rows;
}

}  // namespace lumi
