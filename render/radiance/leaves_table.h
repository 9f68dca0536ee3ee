// P_same of correlation.h from a table over log h: for weights that are taken one by one, thousands of times a frame.
// Absolute error below 1e-5, for leaves of nearly one size below 1e-4; relative below 1e-3 down to values of 1e-5.
#pragma once

#include <vector>

namespace lumi {

class LeavesTable {
 public:
  // As FallingLeaves.
  LeavesTable(double r_min_rad, double r_max_rad);
  bool Is(double r_min_rad, double r_max_rad) const { return r_min_ == r_min_rad && r_max_ == r_max_rad; }
  // h >= 0, infinity allowed.
  double operator()(double h_rad) const;
  double r_max_rad() const { return r_max_; }

 private:
  double r_min_, r_max_;
  std::vector<double> small_, end_;
};

}  // namespace lumi
