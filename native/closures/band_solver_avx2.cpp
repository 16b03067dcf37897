// Compiled with -mavx2 -mfma on x86-64 (CMakeLists.txt); empty elsewhere.
#if defined(__x86_64__)

#include "closures/band_solver_avx2.h"

#include "closures/band_solver_lanes.inc"

namespace lobefit {

void solve_band_avx2(const Band& band, double* b) { solve(band, b); }

}  // namespace lobefit

#endif
