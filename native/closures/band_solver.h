// Cholesky's method for BandMatrix. Without Eigen and the standard library, see
// measurement/lanes.inc.
#pragma once

#include <cstddef>

namespace lobefit {

// The lower half of a symmetric matrix: element (i, j), j <= i <= j + width, at
// elements[j stride + i - j]. The stride is width + 1 + band_padding at least, and all elements
// beyond the width or the size are 0.
struct Band {
  double* elements;
  std::ptrdiff_t size, width, stride;
};
inline constexpr std::ptrdiff_t band_padding = 10;

// Pivots that rounding leaves below this count as this.
inline constexpr double least_pivot = 1e-12;

// Puts the x of matrix x = b in place of b, of band.size numbers, and the factor in place of the
// matrix.
void solve_band(const Band& band, double* b);

}  // namespace lobefit
