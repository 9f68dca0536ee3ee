// Dense solvers for the few dozen unknowns of a camera, a point or a transformation.
//
// One instantiation of each for all: Eigen unrolls its solvers anew for every fixed size and every file, which took the
// compiler up to half a minute each and gained nothing that a user would notice. Where a solver is the inner loop, it
// stays where it is.
#pragma once

#include <Eigen/Core>
#include <optional>

namespace lumi {

using MatrixIn = Eigen::Ref<const Eigen::MatrixXd>;
using VectorIn = Eigen::Ref<const Eigen::VectorXd>;

struct SymmetricEigen {
  Eigen::VectorXd values;   // ascending
  Eigen::MatrixXd vectors;  // a column each, of length 1
};

// A is square and symmetric; only its lower half is read. Not-a-number in, not-a-number out.
SymmetricEigen EigenOfSymmetric(const MatrixIn& A);

// The unit vector x that minimises x^T A x.
Eigen::VectorXd LeastDirection(const MatrixIn& A);

// x of A x = b, A symmetric and positive (by LDL^T, so that a direction without weight does no harm to the others).
Eigen::MatrixXd SolveSymmetric(const MatrixIn& A, const MatrixIn& b);

// The shortest x that minimises |A x - b|; A symmetric, of any rank.
Eigen::VectorXd SolveLeastNorm(const MatrixIn& A, const VectorIn& b);

// A = U diag(values) V^T, values descending; V is square, U too unless A is tall (then it has A's shape). Jacobi for
// its relative accuracy: gaps of a spectrum can be read down to the rounding of its largest value.
struct SingularValueDecomposition {
  Eigen::MatrixXd U;
  Eigen::VectorXd values;
  Eigen::MatrixXd V;
};
SingularValueDecomposition DecomposeSingular(const MatrixIn& A);
Eigen::VectorXd SingularValues(const MatrixIn& A);

// Of a square matrix; none where it is singular to rounding, or its reciprocal condition is below the given one.
std::optional<Eigen::MatrixXd> InverseOf(const MatrixIn& A, double min_rcond = 0);

// Orthonormal columns: those that span A's, and those that are perpendicular to all of them. A is tall.
Eigen::MatrixXd OrthonormalColumns(const MatrixIn& A);
Eigen::MatrixXd PerpendicularColumns(const MatrixIn& A);

// The rotation R that maximises trace(R A^T): the one nearest to A, and the Kabsch rotation of a covariance A = sum
// target source^T.
Eigen::Matrix3d NearestRotation(const Eigen::Matrix3d& A);

}  // namespace lumi
