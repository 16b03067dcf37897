// The fit as one writes it with Ceres, to compare the fit of this project with.
#pragma once

#include "fitting/monitor.h"
#include "fitting/samples.h"
#include "measurement/measurement.h"
#include "reflectance/model.h"

namespace lobefit {

struct NaiveFit {
  Parameters parameters;
  int bins = 0;        // that were fitted
  int iterations = 0;  // of Ceres, the start among them
  int passes = 0;      // over the bins, for values or for derivatives
  bool converged = false;
  double seconds = 0;  // of setting up and solving
};

// What others than our own fit are given to fit by plain L1: about `bins` of a measurement's bins,
// drawn and weighted so that their optimum is that of all (subsample); of 0, or of no fewer than
// there are, all of them. Throws InputError for fewer than 0.
Samples samples_for_others(const Measurement& measurement, int bins, int threads);

// Fits the interpolated model with Fresnel to those by the smoothed L1: for each measured value a
// residual block, differentiated automatically, under a SoftLOneLoss of the width that ends our own
// fits (scaled where the value's weight is not 1), within Ceres' bounds, by the solver that is
// fastest here (dense normal equations). It begins at `start`, which has to be of that model, and
// it throws Cancelled.
NaiveFit fit_naively(const Samples& samples, const Parameters& start, int threads,
                     const Monitor& monitor);

}  // namespace lobefit
