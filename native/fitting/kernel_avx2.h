// The kernel as kernel_avx2.cpp compiles it; for kernel_baseline.cpp, which chooses.
#pragma once

#include "fitting/kernel.h"

namespace lobefit {

KernelSums run_kernel_avx2(const KernelInput& input, KernelNorm norm);
void run_powers_avx2(const PowerInput& input, double* powers);

}  // namespace lobefit
