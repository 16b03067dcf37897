// Compiled with -mavx2 -mfma on x86-64 (CMakeLists.txt); empty elsewhere.
#if defined(__x86_64__)

#include "fitting/kernel_avx2.h"

#include "fitting/kernel_lanes.inc"

namespace lobefit {

KernelSums run_kernel_avx2(const KernelInput& input, KernelNorm norm) {
  return sum_norm(input, norm);
}

void run_powers_avx2(const PowerInput& input, double* powers) { fill_powers(input, powers); }

}  // namespace lobefit

#endif
