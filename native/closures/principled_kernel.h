// The innermost loop of the Principled BSDF's fit: all lights of a view. Without Eigen and the
// standard library, see measurement/lanes.inc.
#pragma once

#include <cstddef>

#include "closures/principled_terms.h"

namespace lobefit {

// What is known of each light, see TargetLight.
struct PrincipledKernelLights {
  std::size_t count;  // a multiple of principled_kernel_lanes
  FacetLight<const double*> at;
  const double* reflected[3];
  const double* weight;
  const double* typical;
};

inline constexpr std::size_t principled_kernel_lanes = 4;

struct PrincipledKernelInput {
  PrincipledKernelLights lights;
  PrincipledTerms terms;
  double base_color[3];
  double specular_tint[3];
  double smoothing;  // |r| is rounded off below so many times typical
};

// By channel, in the order of PrincipledSlopes: the gradient J'Wr of the error and the lower half
// of the matrix J'WJ of its reweighted least squares, with W = weight / |r| rounded off.
struct PrincipledKernelSums {
  static constexpr int slopes = PrincipledSlopes::count;
  double gradient[3][slopes];
  double matrix[3][slopes][slopes];
};

PrincipledKernelSums run_principled_kernel(const PrincipledKernelInput& input);
// The sum of weight times |r|, rounded off: sqrt(r^2 + e^2) - e, e = smoothing x typical.
double run_principled_error(const PrincipledKernelInput& input);

}  // namespace lobefit
