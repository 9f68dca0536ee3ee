#include "reconstruct/nelder_mead.h"

#include <algorithm>
#include <opencv2/core/optim.hpp>

namespace lumi {
namespace {

// The function of the variables that have a step. DownhillSolver wants two of them: a single one is joined by one that
// counts for nothing.
class FreeVariables final : public cv::MinProblemSolver::Function {
 public:
  FreeVariables(const std::function<double(const std::vector<double>&)>& f, const std::vector<double>& start,
                const std::vector<double>& step)
      : f_(f), x_(start) {
    for (std::size_t i = 0; i < step.size(); ++i)
      if (step[i] != 0) free_.push_back(i);
  }
  int getDims() const override { return std::max(2, static_cast<int>(free_.size())); }
  double calc(const double* free) const override { return f_(WithFree(free)); }
  std::vector<double> WithFree(const double* free) const {
    std::vector<double> x = x_;
    for (std::size_t k = 0; k < free_.size(); ++k) x[free_[k]] = free[k];
    return x;
  }
  std::vector<double> Free(const std::vector<double>& x) const {
    std::vector<double> free;
    for (const std::size_t i : free_) free.push_back(x[i]);
    if (free.size() == 1) free.push_back(free[0]);
    return free;
  }

 private:
  const std::function<double(const std::vector<double>&)>& f_;
  std::vector<double> x_;
  std::vector<std::size_t> free_;
};

}  // namespace

std::vector<double> NelderMead(const std::function<double(const std::vector<double>&)>& f,
                               const std::vector<double>& start, const std::vector<double>& step, int max_evaluations,
                               double tolerance) {
  const auto free = cv::makePtr<FreeVariables>(f, start, step);
  std::vector<double> x = free->Free(start);
  if (x.empty()) return start;
  const cv::TermCriteria criteria(cv::TermCriteria::MAX_ITER + cv::TermCriteria::EPS, max_evaluations, tolerance);
  cv::DownhillSolver::create(free, free->Free(step), criteria)->minimize(x);
  return free->WithFree(x.data());
}

}  // namespace lumi
