// The least misfit from a given start, by Ceres.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "fitting/monitor.h"
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
};

// How finely to minimise: the smoothing e of each level in units of the median reflectance, and
// the relative change of the objective at which a level ends.
struct Precision {
  std::vector<double> smoothing;
  double tolerance;
  int iterations;
};
Precision coarse_precision();     // to choose between starts
Precision fine_precision();       // from anywhere
Precision finishing_precision();  // from close by
Precision last_precision();       // from the minimum of a subsample

// Moves the variables `free` from x, level by level of smoothing, until the unsmoothed objective
// stops improving, within the bounds: a variable at its bound is held there while its gradient
// points outward. Throws Cancelled.
Minimum minimise(const Samples& samples, const Variables& variables, Norm norm,
                 const std::vector<int>& free, const Eigen::VectorXd& x, const Precision& precision,
                 int threads, const Monitor& monitor);

}  // namespace lobefit
