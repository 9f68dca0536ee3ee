// Labels for the samples of a grid, each near what its own costs say and near its neighbours': min-sum belief
// propagation over the four neighbours, by a chessboard's colours (Felzenszwalb & Huttenlocher 2006).
#pragma once

#include <vector>

namespace lumi {

// costs: [sample][label], samples row by row. Two neighbours k labels apart cost slope * k, and at most `most`. Between
// labels where the parabola through the best and the two beside it says so.
std::vector<double> SmoothLabels(const std::vector<float>& costs, int columns, int rows, float slope, float most);

}  // namespace lumi
