// Small dense linear programs: few unknowns, many constraints (Seidel 1991: randomised incremental, expected time
// linear in the constraints). By hand: CGAL, whose headers cost 15 s of compiling, stays in proxy.
// proxy/simplify/halfspace_program is the same method for another question, the allowed point nearest to a goal in
// three dimensions, unique and found in a microsecond; this one's optimum is a vertex, exact in its margin.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

namespace lumi {

// The x that maximises c . x with A x <= b and |x_k| <= bound. Shapes: A (n, d), b (n), c (d), 1 <= d <= 8; rows of A
// of about unit size. nullopt: no x satisfies all (beyond 1e-10). The order in which constraints are met is drawn with
// `seed`; the optimum's value does not depend on it.
std::optional<Eigen::VectorXd> SolveLinearProgram(const Eigen::MatrixXd& A, const Eigen::VectorXd& b,
                                                  const Eigen::VectorXd& c, double bound, std::uint64_t seed = 0);

}  // namespace lumi
