#include "fitting/kernel_avx2.h"
#include "fitting/kernel_lanes.inc"
#include "measurement/instructions.h"

namespace lobefit {

#if defined(__x86_64__)

KernelSums run_kernel(const KernelInput& input, KernelNorm norm) {
  return uses_avx2() ? run_kernel_avx2(input, norm) : sum_norm(input, norm);
}

void run_powers(const PowerInput& input, double* powers) {
  return uses_avx2() ? run_powers_avx2(input, powers) : fill_powers(input, powers);
}

#else

KernelSums run_kernel(const KernelInput& input, KernelNorm norm) { return sum_norm(input, norm); }

void run_powers(const PowerInput& input, double* powers) { fill_powers(input, powers); }

#endif

}  // namespace lobefit
