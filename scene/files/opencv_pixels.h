// The only place that converts between OpenCV's pixels (first centre at (0, 0)) and ours (at (0.5, 0.5)).
#pragma once

#include <Eigen/Core>

namespace lumi {

inline Eigen::Vector2d FromOpenCvPixel(const Eigen::Vector2d& x) { return x.array() + 0.5; }
inline Eigen::Vector2d ToOpenCvPixel(const Eigen::Vector2d& x) { return x.array() - 0.5; }

}  // namespace lumi
