// Compiled with -mavx2 -mfma on x86-64 (CMakeLists.txt); empty elsewhere.
#if defined(__x86_64__)

#include "fitting/kernel_lanes.inc"

namespace lobefit {

KernelSums run_kernel_avx2(const KernelInput& input, KernelNorm norm);
KernelSums run_kernel_avx2(const KernelInput& input, KernelNorm norm) {
  return sum_norm(input, norm);
}

}  // namespace lobefit

#endif
