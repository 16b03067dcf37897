// Where to start: every basin of the objective, found from the data.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "fitting/monitor.h"
#include "fitting/options.h"
#include "fitting/samples.h"
#include "fitting/variables.h"

namespace lobefit {

struct Candidate {
  Eigen::VectorXd x;
  double true_value;  // of the objective at x, with its best reflectances
};

// For a fixed shape (s, alpha, eta) the best rho_d and k_s are a convex problem, so that a scan
// over a grid of shapes on a small subsample sees every basin. Returns the best exponent for each
// (alpha, eta) of the grid and the points without a better neighbour, best first, `count` at most,
// the best of alpha = 0 and of alpha = 1 among them. Throws Cancelled.
std::vector<Candidate> scan_shapes(const Samples& few, const Variables& variables, Norm norm,
                                   std::size_t count, int threads, const Monitor& monitor);

}  // namespace lobefit
