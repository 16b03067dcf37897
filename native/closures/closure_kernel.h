// The innermost loop of the search for closures: all lights of a view against a diffuse and some
// specular closures. Without Eigen and the standard library, see measurement/lanes.inc.
#pragma once

#include <cstddef>

#include "closures/microfacet_terms.h"

namespace lobefit {

inline constexpr int most_specular_closures = 3;

// What is known of each light, see TargetLight, in its columns by SearchLights, and what its
// closures are compared with.
template <typename Scalar>
struct ClosureKernelInput {
  std::size_t count;  // a multiple of closure_kernel_lanes
  const Scalar* wi[3];
  const Scalar* half[3];
  const Scalar* reflected[3];  // by what is typical there
  const Scalar* weight;        // of a difference as large as what is typical
  const Scalar* inverse_typical;

  int specular;
  MicrofacetTermsOf<Scalar> closures[most_specular_closures];
  Scalar weights[most_specular_closures + 1][3];  // the diffuse closure's after the specular ones'
  Scalar smoothing;                               // |r| is rounded off below so many times typical
};

inline constexpr std::size_t closure_kernel_lanes = 8;

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

// Sums over the lights of weight times v_k, and times its derivatives by that closure's shape.
struct ClosureKernelLight {
  double v[ClosureKernelSums::closures];
  double by_shape[ClosureKernelSums::shapes];
};

// All for at most most_specular_closures. A step toward less error needs no double precision.
ClosureKernelSums run_closure_kernel(const ClosureKernelInput<float>& input);
// The sum of weight times |r|, rounded off.
double run_closure_error(const ClosureKernelInput<float>& input);
double run_closure_error(const ClosureKernelInput<double>& input);
ClosureKernelLight run_closure_light(const ClosureKernelInput<float>& input);

}  // namespace lobefit
