// The best few closures for any reflectance.
#pragma once

#include "closures/closure_set.h"
#include "closures/target.h"
#include "fitting/monitor.h"

namespace lobefit {

struct ClosureFitOptions {
  int specular = 2;         // closures besides the diffuse one, 0 to 3
  bool cap_albedo = false;  // keeps the albedo at 1 or less where the target exceeds it
  int threads = 0;          // 0: every processor; the result is the same for any number
};

// The albedo toward the viewer of a target and of the closures, over the lights where the target is
// known, and the part of the error that each view angle adds, in its own light.
struct SeenAtAngle {
  double cosine;
  Rgb target_albedo;
  Rgb closures_albedo;
  double relative_error;
};

// Closures and their error as error_of measures it.
struct FittedClosures {
  ClosureSet closures;
  double error = 0;
  std::vector<SeenAtAngle> by_view;
};

// The diffuse closure and `specular` GGX or Beckmann closures whose sum is nearest to the target by
// error_of. Their roughness, anisotropy, bend and weights are smooth curves of the cosine of the
// view angle, all view angles fitted jointly; at normal incidence they are isotropic and not bent.
// The search keeps them near the target's albedo; where they still reflect over 1 % more, their
// weights are lowered. A closure that the error does not miss is left out. A target without samples
// gives no closures and the error 0. Throws Cancelled.
FittedClosures fit_closures(const Target& target, const ClosureFitOptions& options,
                            Monitor& monitor);

// The fewest closures whose error is at most `tolerance`, or else the best there are.
FittedClosures fit_closures_within(const Target& target, double tolerance,
                                   ClosureFitOptions options, Monitor& monitor);

}  // namespace lobefit
