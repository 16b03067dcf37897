#include "measurement/instructions.h"

#include <atomic>

#if defined(__x86_64__)
#include <cpuid.h>
#endif

namespace lobefit {
namespace {

std::atomic<int> baselines = 0;

#if defined(__x86_64__)
// By the instruction itself: __builtin_cpu_supports wants a run-time library that not every clang
// links. Intel's Software Developer's Manual, volume 1, 14.3 and 14.5.3.
bool processor_has_avx2() {
  unsigned a = 0, b = 0, c = 0, d = 0;
  constexpr unsigned wanted = bit_FMA | bit_AVX | bit_OSXSAVE;
  if (!__get_cpuid(1, &a, &b, &c, &d) || (c & wanted) != wanted) return false;
  // The operating system keeps the wide registers of a thread, both halves of them.
  unsigned kept = 0, high = 0;
  __asm__("xgetbv" : "=a"(kept), "=d"(high) : "c"(0));
  if ((kept & 6) != 6) return false;
  return __get_cpuid_count(7, 0, &a, &b, &c, &d) && (b & bit_AVX2) != 0;
}
#endif

}  // namespace

BaselineInstructions::BaselineInstructions() { ++baselines; }
BaselineInstructions::~BaselineInstructions() { --baselines; }

bool has_avx2() {
#if defined(__x86_64__)
  static const bool has = processor_has_avx2();
  return has;
#else
  return false;
#endif
}

bool uses_avx2() { return has_avx2() && baselines == 0; }

}  // namespace lobefit
