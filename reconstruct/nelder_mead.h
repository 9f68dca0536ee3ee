// Minimum of a function of a few variables without derivatives (Nelder & Mead 1965; OpenCV), from a start and a step
// for each variable; a step of 0 holds the variable.
#pragma once

#include <functional>
#include <vector>

namespace lumi {

std::vector<double> NelderMead(const std::function<double(const std::vector<double>&)>& f,
                               const std::vector<double>& start, const std::vector<double>& step,
                               int max_evaluations = 600, double tolerance = 1e-9);

}  // namespace lumi
