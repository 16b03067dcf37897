// The innermost loop of the search for closures: all lights of a view against a diffuse and some
// specular closures. Without Eigen and the standard library, see measurement/lanes.inc.
#pragma once

#include <cstddef>

#include "closures/microfacet_terms.h"

namespace lobefit {

inline constexpr int most_specular_closures = 3;

// What is known of each light, see TargetLight, and what its closures are compared with.
struct ClosureKernelInput {
  std::size_t count;  // a multiple of closure_kernel_lanes
  const double* wi[3];
  const double* half[3];
  const double* reflected[3];
  const double* weight;
  const double* typical;

  int specular;
  MicrofacetTerms closures[most_specular_closures];
  double weights[most_specular_closures + 1][3];  // the diffuse closure's after the specular ones'
  double smoothing;                               // |r| is rounded off below so many times typical
};

inline constexpr std::size_t closure_kernel_lanes = 4;

// Sums over the lights, from which gradient J'Wr and the matrix J'WJ of reweighted least squares
// follow, with W = weight / |r| rounded off. v_k is what closure k reflects per weight, and x its
// shape, three numbers a specular closure: ln alpha_x, ln alpha_y, tilt. Of symmetric matrices the
// lower half.
struct ClosureKernelSums {
  static constexpr int closures = most_specular_closures + 1, shapes = 3 * most_specular_closures;
  double gradient_v[3][closures];           // W r v, by channel
  double gradient_x[shapes];                // W r df/dx, summed over the channels
  double matrix_vv[3][closures][closures];  // W v v
  double matrix_vx[3][closures]
                  [shapes];          // W v dv/dx, to be multiplied by the weight of x's closure
  double matrix_xx[shapes][shapes];  // W df/dx df/dx, summed over the channels
};

// Both for at most most_specular_closures.
ClosureKernelSums run_closure_kernel(const ClosureKernelInput& input);
// The sum of weight times |r|, rounded off.
double run_closure_error(const ClosureKernelInput& input);

}  // namespace lobefit
