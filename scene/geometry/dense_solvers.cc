#include "scene/geometry/dense_solvers.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <cmath>
#include <limits>

namespace lumi {

using Eigen::MatrixXd;
using Eigen::VectorXd;

SymmetricEigen EigenOfSymmetric(const MatrixIn& A) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(A);
  return {eigen.eigenvalues(), eigen.eigenvectors()};
}

VectorXd LeastDirection(const MatrixIn& A) { return EigenOfSymmetric(A).vectors.col(0); }

MatrixXd SolveSymmetric(const MatrixIn& A, const MatrixIn& b) { return Eigen::LDLT<MatrixXd>(A).solve(b); }

VectorXd SolveLeastNorm(const MatrixIn& A, const VectorIn& b) {
  const SymmetricEigen eigen = EigenOfSymmetric(A);
  const double negligible =
      std::numeric_limits<double>::epsilon() * static_cast<double>(A.rows()) * eigen.values.cwiseAbs().maxCoeff();
  VectorXd along = eigen.vectors.transpose() * b;
  for (Eigen::Index i = 0; i < along.size(); ++i)
    along[i] = std::abs(eigen.values[i]) <= negligible ? 0 : along[i] / eigen.values[i];
  return eigen.vectors * along;
}

namespace {

using Jacobi = Eigen::JacobiSVD<MatrixXd, Eigen::HouseholderQRPreconditioner>;

}  // namespace

SingularValueDecomposition DecomposeSingular(const MatrixIn& A) {
  const Jacobi svd(A, (A.rows() > A.cols() ? Eigen::ComputeThinU : Eigen::ComputeFullU) | Eigen::ComputeFullV);
  return {svd.matrixU(), svd.singularValues(), svd.matrixV()};
}

VectorXd SingularValues(const MatrixIn& A) { return Jacobi(A).singularValues(); }

std::optional<MatrixXd> InverseOf(const MatrixIn& A, double min_rcond) {
  const Eigen::FullPivLU<MatrixXd> lu(A);
  if (!lu.isInvertible() || !(lu.rcond() >= min_rcond)) return std::nullopt;
  return lu.inverse();
}

MatrixXd OrthonormalColumns(const MatrixIn& A) {
  return Eigen::HouseholderQR<MatrixXd>(A).householderQ() * MatrixXd::Identity(A.rows(), A.cols());
}

MatrixXd PerpendicularColumns(const MatrixIn& A) {
  const MatrixXd last = MatrixXd::Identity(A.rows(), A.rows()).rightCols(A.rows() - A.cols());
  return Eigen::HouseholderQR<MatrixXd>(A).householderQ() * last;
}

Eigen::Matrix3d NearestRotation(const Eigen::Matrix3d& A) {
  const SingularValueDecomposition svd = DecomposeSingular(A);
  const Eigen::Matrix3d U = svd.U, V = svd.V;
  const double turn = (U * V.transpose()).determinant() < 0 ? -1.0 : 1.0;
  return U * Eigen::Vector3d(1, 1, turn).asDiagonal() * V.transpose();
}

}  // namespace lumi
