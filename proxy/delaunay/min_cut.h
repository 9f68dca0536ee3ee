// Minimum s-t cut over the cells of a tetrahedralisation (Boykov & Kolmogorov 2004, Boost.Graph's implementation).
// Capacities are integers, so that the result depends neither on the order of sums nor on rounding.
#pragma once

#include <cstdint>
#include <vector>

#include "proxy/delaunay/tetrahedra.h"

namespace lumi {

using Capacity = std::int64_t;

struct CutProblem {
  std::vector<Capacity> source;                // a cell: paid when it is labelled full
  std::vector<Capacity> sink;                  // a cell: paid when it is labelled free
  std::vector<std::array<Capacity, 4>> facet;  // [c][i]: paid when c is free and its neighbour across facet i is full
};

// Whether each cell is free (on the source's side). Cells in no term are full.
std::vector<std::uint8_t> SolveMinCut(const Tetrahedra& tets, const CutProblem& problem);

}  // namespace lumi
