// Symmetric positive definite matrices that vanish away from the diagonal.
#pragma once

#include <Eigen/Core>

namespace lobefit {

// The lower half of a symmetric matrix whose elements (i, j) are 0 for i - j > band.
class BandMatrix {
 public:
  BandMatrix() = default;
  BandMatrix(Eigen::Index size, Eigen::Index band) { reset(size, band); }

  // A matrix of zeros; where it has the same size as the last, in the same memory.
  void reset(Eigen::Index size, Eigen::Index band);

  Eigen::Index size() const { return columns_.cols(); }
  Eigen::Index band() const { return band_; }
  // j <= i <= j + band.
  double operator()(Eigen::Index i, Eigen::Index j) const { return columns_(i - j, j); }
  double& operator()(Eigen::Index i, Eigen::Index j) { return columns_(i - j, j); }
  // So many elements of a column downward from one of them.
  auto below(Eigen::Index i, Eigen::Index j, Eigen::Index count) {
    return columns_.col(j).segment(i - j, count);
  }
  auto below(Eigen::Index i, Eigen::Index j, Eigen::Index count) const {
    return columns_.col(j).segment(i - j, count);
  }

  // The x of matrix x = b, by Cholesky's method in place: the matrix holds its factor afterwards.
  // Pivots that rounding leaves below a tiny part of a unit diagonal count as that.
  Eigen::VectorXd solve_in_place(Eigen::VectorXd b);

 private:
  Eigen::MatrixXd columns_;  // element (i, j) in row i - j; rows of zeros below
  Eigen::Index band_ = 0;
};

}  // namespace lobefit
