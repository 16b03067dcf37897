// The solver as band_solver_avx2.cpp compiles it; for band_solver_baseline.cpp, which chooses.
#pragma once

#include "closures/band_solver.h"

namespace lobefit {

void solve_band_avx2(const Band& band, double* b);

}  // namespace lobefit
