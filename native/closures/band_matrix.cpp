#include "closures/band_matrix.h"

#include <algorithm>
#include <cmath>

namespace lobefit {

BandMatrix::BandMatrix(Eigen::Index size, Eigen::Index band)
    : columns_(Eigen::MatrixXd::Zero(std::min(band + 1, size), size)) {}

Eigen::VectorXd BandMatrix::solve_in_place(Eigen::VectorXd b) {
  constexpr double least_pivot = 1e-12;
  for (Eigen::Index j = 0; j < size(); ++j) {
    const Eigen::Index below = std::min(band(), size() - 1 - j);
    const double pivot = std::sqrt(std::max(columns_(0, j), least_pivot));
    columns_(0, j) = pivot;
    auto factor = columns_.col(j).segment(1, below);
    factor /= pivot;
    for (Eigen::Index k = 0; k < below; ++k) {
      columns_.col(j + 1 + k).head(below - k) -= factor[k] * factor.tail(below - k);
    }
    b[j] /= pivot;
    b.segment(j + 1, below) -= b[j] * factor;
  }
  for (Eigen::Index j = size(); j-- > 0;) {
    const Eigen::Index below = std::min(band(), size() - 1 - j);
    b[j] -= columns_.col(j).segment(1, below).dot(b.segment(j + 1, below));
    b[j] /= columns_(0, j);
  }
  return b;
}

}  // namespace lobefit
