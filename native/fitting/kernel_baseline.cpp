#include <atomic>

#include "fitting/kernel_avx2.h"
#include "fitting/kernel_lanes.inc"

namespace lobefit {
namespace {
std::atomic<int> baseline_kernels = 0;
}  // namespace

BaselineKernel::BaselineKernel() { ++baseline_kernels; }
BaselineKernel::~BaselineKernel() { --baseline_kernels; }

#if defined(__x86_64__)

bool has_avx2() {
  static const bool has = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  return has;
}

namespace {
bool uses_avx2() { return has_avx2() && baseline_kernels == 0; }
}  // namespace

KernelSums run_kernel(const KernelInput& input, KernelNorm norm) {
  return uses_avx2() ? run_kernel_avx2(input, norm) : sum_norm(input, norm);
}

void run_powers(const PowerInput& input, double* powers) {
  return uses_avx2() ? run_powers_avx2(input, powers) : fill_powers(input, powers);
}

#else

bool has_avx2() { return false; }

KernelSums run_kernel(const KernelInput& input, KernelNorm norm) { return sum_norm(input, norm); }

void run_powers(const PowerInput& input, double* powers) { fill_powers(input, powers); }

#endif

}  // namespace lobefit
