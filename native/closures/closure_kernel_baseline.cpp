#include "closures/closure_kernel_avx2.h"
#include "closures/closure_kernel_lanes.inc"
#include "measurement/instructions.h"

namespace lobefit {

#if defined(__x86_64__)

ClosureKernelSums run_closure_kernel(const ClosureKernelInput<float>& input) {
  return uses_avx2() ? run_closure_kernel_avx2(input) : sum_closures(input);
}

double run_closure_error(const ClosureKernelInput<float>& input) {
  return uses_avx2() ? run_closure_error_avx2(input) : error_of_closures(input);
}

double run_closure_error(const ClosureKernelInput<double>& input) {
  return uses_avx2() ? run_closure_error_avx2(input) : error_of_closures(input);
}

ClosureKernelLight run_closure_light(const ClosureKernelInput<float>& input) {
  return uses_avx2() ? run_closure_light_avx2(input) : light_of_closures(input);
}

#else

ClosureKernelSums run_closure_kernel(const ClosureKernelInput<float>& input) {
  return sum_closures(input);
}

double run_closure_error(const ClosureKernelInput<float>& input) {
  return error_of_closures(input);
}

double run_closure_error(const ClosureKernelInput<double>& input) {
  return error_of_closures(input);
}

ClosureKernelLight run_closure_light(const ClosureKernelInput<float>& input) {
  return light_of_closures(input);
}

#endif

}  // namespace lobefit
