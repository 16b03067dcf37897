#include "closures/band_matrix.h"

#include <algorithm>

#include "closures/band_solver.h"

namespace lobefit {

void BandMatrix::reset(Eigen::Index size, Eigen::Index band) {
  band_ = std::min(band, size - 1);
  columns_.setZero(band_ + 1 + band_padding, size);
}

Eigen::VectorXd BandMatrix::solve_in_place(Eigen::VectorXd b) {
  solve_band({columns_.data(), size(), band(), columns_.rows()}, b.data());
  return b;
}

}  // namespace lobefit
