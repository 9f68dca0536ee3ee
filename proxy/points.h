// The sparse points a proxy is built from: those of the scene that can be trusted, each with the views that saw it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "scene/model/scene.h"

namespace lumi {

struct PointSelectionOptions {
  double max_error_px = 4.0;   // mean reprojection error; COLMAP's own filter is 4
  double min_angle_deg = 1.5;  // largest angle between two of its rays: below, the depth is a guess
  int min_track = 3;           // views a point, where enough_points remain; else 2
  int enough_points = 2000;
  int neighbours = 8;               // for the outlier test below
  double max_neighbour_ratio = 30;  // mean distance to the neighbours, in footprints, against the median point's
};

struct ProxyPoint {
  Eigen::Vector3d x_in_world = Eigen::Vector3d::Zero();
  std::vector<std::int32_t> views;  // positions in Scene::views, ascending, each once
  double footprint = 0;             // size of a pixel at the point in the view that sees it finest, in world units
  double sigma = 0;                 // standard deviation of its position along the rays, in world units
};

struct PointSelection {
  std::vector<ProxyPoint> points;
  std::size_t total = 0;
  std::size_t unusable = 0;    // NaN, fewer than two views in front of which it lies
  std::size_t inaccurate = 0;  // error, angle or track
  std::size_t isolated = 0;    // outliers by neighbour distance
};

// A view as proxies read it.
struct ProxyView {
  RenderView render;
  double focal_px = 1;
  Eigen::Vector3d forward = Eigen::Vector3d::UnitZ();  // unit, in world
  double DepthOf(const Eigen::Vector3d& x_in_world) const { return (x_in_world - render.centre).dot(forward); }
};
// Throws DataError for scenes that are not metric or have no view.
std::vector<ProxyView> MakeProxyViews(const Scene& scene);

PointSelection SelectPoints(const Scene& scene, const std::vector<ProxyView>& views,
                            const PointSelectionOptions& options);

// Points closer than `distance` footprints become one: the one seen by most views stays where it is and takes over the
// others' views. Order of the result: by number of views, then by sigma.
std::vector<ProxyPoint> MergePoints(const std::vector<ProxyPoint>& points, double distance);

// Mean distance from each point to its k nearest others.
std::vector<double> MeanNeighbourDistance(const std::vector<Eigen::Vector3d>& points, int k);

}  // namespace lumi
