#include "measurement/instructions.h"

#include <atomic>

namespace lobefit {
namespace {
std::atomic<int> baselines = 0;
}  // namespace

BaselineInstructions::BaselineInstructions() { ++baselines; }
BaselineInstructions::~BaselineInstructions() { --baselines; }

bool has_avx2() {
#if defined(__x86_64__)
  static const bool has = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  return has;
#else
  return false;
#endif
}

bool uses_avx2() { return has_avx2() && baselines == 0; }

}  // namespace lobefit
