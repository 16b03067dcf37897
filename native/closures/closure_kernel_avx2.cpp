// Compiled with -mavx2 -mfma on x86-64 (CMakeLists.txt); empty elsewhere.
#if defined(__x86_64__)

#include "closures/closure_kernel_avx2.h"

#include "closures/closure_kernel_lanes.inc"

namespace lobefit {

ClosureKernelSums run_closure_kernel_avx2(const ClosureKernelInput<float>& input) {
  return sum_closures(input);
}

double run_closure_error_avx2(const ClosureKernelInput<float>& input) {
  return error_of_closures(input);
}

double run_closure_error_avx2(const ClosureKernelInput<double>& input) {
  return error_of_closures(input);
}

ClosureKernelLight run_closure_light_avx2(const ClosureKernelInput<float>& input) {
  return light_of_closures(input);
}

}  // namespace lobefit

#endif
