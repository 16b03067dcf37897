// Compiled with -mavx2 -mfma on x86-64 (CMakeLists.txt); empty elsewhere.
#if defined(__x86_64__)

#include "closures/principled_kernel_avx2.h"

#include "closures/principled_kernel_lanes.inc"

namespace lobefit {

PrincipledKernelSums run_principled_kernel_avx2(const PrincipledKernelInput& input) {
  return sum_principled(input);
}

double run_principled_error_avx2(const PrincipledKernelInput& input) {
  return error_of_principled(input);
}

}  // namespace lobefit

#endif
