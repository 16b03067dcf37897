#include "fitting/kernel_lanes.inc"

namespace lobefit {

#if defined(__x86_64__)
KernelSums run_kernel_avx2(const KernelInput& input, KernelNorm norm);

KernelSums run_kernel(const KernelInput& input, KernelNorm norm) {
  static const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  return avx2 ? run_kernel_avx2(input, norm) : sum_norm(input, norm);
}
#else
KernelSums run_kernel(const KernelInput& input, KernelNorm norm) { return sum_norm(input, norm); }
#endif

}  // namespace lobefit
