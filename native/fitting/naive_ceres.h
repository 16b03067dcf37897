// The fit as one writes it with Ceres, to compare the fit of this project with.
#pragma once

#include "fitting/monitor.h"
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

// Fits the interpolated model with Fresnel to one in `every` valid bins by the smoothed L1: for
// each of them and each channel a residual block, differentiated automatically, under a
// SoftLOneLoss of the width that ends our own fits, within Ceres' bounds, by the solver that is
// fastest here (dense normal equations). It begins at `start`, which has to be of that model, and
// it throws Cancelled.
NaiveFit fit_naively(const Measurement& measurement, const Parameters& start, int every,
                     int threads, const Monitor& monitor);

}  // namespace lobefit
