#include "fitting/kernel_avx2.h"
#include "fitting/kernel_lanes.inc"

namespace lobefit {

#if defined(__x86_64__)

namespace {
bool has_avx2() {
  static const bool has = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  return has;
}
}  // namespace

KernelSums run_kernel(const KernelInput& input, KernelNorm norm) {
  return has_avx2() ? run_kernel_avx2(input, norm) : sum_norm(input, norm);
}

void run_powers(const PowerInput& input, double* powers) {
  return has_avx2() ? run_powers_avx2(input, powers) : fill_powers(input, powers);
}

#else

KernelSums run_kernel(const KernelInput& input, KernelNorm norm) { return sum_norm(input, norm); }

void run_powers(const PowerInput& input, double* powers) { fill_powers(input, powers); }

#endif

}  // namespace lobefit
