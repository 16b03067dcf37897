// The kernel as principled_kernel_avx2.cpp compiles it; for principled_kernel_baseline.cpp, which
// chooses.
#pragma once

#include "closures/principled_kernel.h"

namespace lobefit {

PrincipledKernelSums run_principled_kernel_avx2(const PrincipledKernelInput& input);
double run_principled_error_avx2(const PrincipledKernelInput& input);

}  // namespace lobefit
