// The fit of a model to a measurement.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fitting/error_figures.h"
#include "fitting/jackknife.h"
#include "fitting/monitor.h"
#include "fitting/options.h"
#include "measurement/measurement.h"
#include "reflectance/model.h"

namespace lobefit {

// One step of a schedule; error is the mean misfit over all bins afterwards, in the norm that is
// fitted (1/sr for the L1 norms).
struct Stage {
  std::string name;
  double error;
  double seconds;
  int iterations;
  std::size_t samples;  // in the largest set that it went over
  double touched;       // samples of all its passes together
};

// How sure the result is: of the `starts` that were polished on a subsample, `agree` ended within
// 0.5 % of the best; spread is (worst - best) / best. A best under the rounding of stored values
// counts as that.
struct Certainty {
  int starts = 0;
  int agree = 0;
  double spread = 0;
};

struct Fit {
  Parameters parameters;
  ErrorFigures errors;
  std::vector<Stage> stages;
  double start_seconds = 0, fit_seconds = 0;
  bool converged = false;
  Certainty certainty;
  std::optional<Uncertainty> uncertainty;  // where the options ask for it
  std::vector<std::string> warnings;       // what is degenerate in the result, a sentence each
};

// Starts come from the data (scan_shapes); what follows is the Schedule's. Throws Cancelled, and
// InputError (of a sentence that does not name the measurement) where no valid bin is within the
// angle asked for.
Fit fit_model(const Measurement& measurement, const FitOptions& options, Monitor& monitor);

// The best of the starts. Throws as fit_model.
Parameters best_start(const Measurement& measurement, const FitOptions& options, Monitor& monitor);

}  // namespace lobefit
