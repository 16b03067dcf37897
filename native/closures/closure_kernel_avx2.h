// The kernel as closure_kernel_avx2.cpp compiles it; for closure_kernel_baseline.cpp, which
// chooses.
#pragma once

#include "closures/closure_kernel.h"

namespace lobefit {

ClosureKernelSums run_closure_kernel_avx2(const ClosureKernelInput<float>& input);
double run_closure_error_avx2(const ClosureKernelInput<float>& input);
double run_closure_error_avx2(const ClosureKernelInput<double>& input);
ClosureKernelLight run_closure_light_avx2(const ClosureKernelInput<float>& input);

}  // namespace lobefit
