// Descriptors of two photos' features, matched both ways with a ratio test.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace lumi {

// Shape (features, length of a descriptor); rows of unit length.
using Descriptors = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

struct DescriptorMatch {
  int a, b;          // features
  float similarity;  // cosine
};

// Each other's nearest, whose distance is at most `ratio` (0 to 1) of that to the second nearest; of the first `most`
// features of each. By a, ascending.
std::vector<DescriptorMatch> MatchDescriptors(const Descriptors& a, const Descriptors& b, double ratio,
                                              Eigen::Index most);

}  // namespace lumi
