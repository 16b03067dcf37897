#include "closures/principled_kernel_avx2.h"
#include "closures/principled_kernel_lanes.inc"
#include "measurement/instructions.h"

namespace lobefit {

#if defined(__x86_64__)

PrincipledKernelSums run_principled_kernel(const PrincipledKernelInput& input) {
  return uses_avx2() ? run_principled_kernel_avx2(input) : sum_principled(input);
}

double run_principled_error(const PrincipledKernelInput& input) {
  return uses_avx2() ? run_principled_error_avx2(input) : error_of_principled(input);
}

#else

PrincipledKernelSums run_principled_kernel(const PrincipledKernelInput& input) {
  return sum_principled(input);
}

double run_principled_error(const PrincipledKernelInput& input) {
  return error_of_principled(input);
}

#endif

}  // namespace lobefit
