// Which of the two versions of code in lanes (lanes.inc) runs; both give the same to rounding.
#pragma once

namespace lobefit {

// Whether this processor has AVX2 and FMA.
bool has_avx2();

// Whether the version for AVX2 is to run: it can, and no BaselineInstructions exist.
bool uses_avx2();

// For tests: while one of these exists every thread runs the version for any x86-64.
class BaselineInstructions {
 public:
  BaselineInstructions();
  ~BaselineInstructions();
  BaselineInstructions(const BaselineInstructions&) = delete;
  BaselineInstructions& operator=(const BaselineInstructions&) = delete;
};

}  // namespace lobefit
