// The least misfit from a given start, by Ceres.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "fitting/monitor.h"
#include "fitting/objective.h"
#include "fitting/options.h"
#include "fitting/samples.h"
#include "fitting/variables.h"

namespace lobefit {

struct Minimum {
  Eigen::VectorXd x;
  double true_value = 0;   // Evaluation::true_value there
  double start_value = 0;  // and where it began
  int iterations = 0;
  int passes = 0;  // over the samples
  bool converged = false;
  NewtonPause pause{};
};

// How finely to minimise. The smoothing e falls from level to level by a factor of 4, down to
// `finest` in units of the median reflectance, from `widest` times the mean misfit of the start on.
// A wide one sees the way that the bulk of the misfit goes: where most of it stands in a few
// grazing bins, thousands of times above the median, a narrow one is stuck at nearly every point.
struct Precision {
  double widest, finest;
  double tolerance;  // the relative change of the objective at which a level ends
  int iterations;    // of a solve
};
Precision coarse_precision();     // to choose between starts
Precision fine_precision();       // from anywhere
Precision finishing_precision();  // from the minimum of a smaller subsample
Precision last_precision();       // from the minimum of a subsample

// Moves the variables `free` from x, level by level of smoothing, until the unsmoothed objective
// stops improving, within the bounds: a variable at its bound is held there while its gradient
// points outward. `pause` is that of the minimum which x is. Throws Cancelled.
Minimum minimise(const Samples& samples, const Variables& variables, Norm norm,
                 const std::vector<int>& free, const Eigen::VectorXd& x, const Precision& precision,
                 int threads, const Monitor& monitor, NewtonPause pause = {});

}  // namespace lobefit
