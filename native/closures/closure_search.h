// The search for the curves of the best few closures.
#pragma once

#include "closures/closure_problem.h"

namespace lobefit {

// Closures and their smooth_error.
struct FoundCurves {
  ClosureCurves closures;
  double error;
};

// The diffuse closure and so many specular ones, their curves still splines, that come nearest to
// the target; the same for any number of threads. Reports progress from 0 to 1. Throws Cancelled.
FoundCurves search_curves(const Target& target, int specular, int threads, Monitor& monitor);

// The best curves near these. Throws Cancelled.
FoundCurves refined(const SearchTarget& target, ClosureCurves closures, int threads,
                    const Monitor& monitor);

}  // namespace lobefit
