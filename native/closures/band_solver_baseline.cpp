#include "closures/band_solver_avx2.h"
#include "closures/band_solver_lanes.inc"
#include "measurement/instructions.h"

namespace lobefit {

void solve_band(const Band& band, double* b) {
#if defined(__x86_64__)
  if (uses_avx2()) return solve_band_avx2(band, b);
#endif
  solve(band, b);
}

}  // namespace lobefit
