// Compiled with vectors, of the four lanes that every x86-64 has.
#include <algorithm>
#include <array>

#include "fitting/kernel.h"
#include "preview/phong_terms.inc"

namespace lobefit {

void phong_terms_in_lanes(const PhongTermInput& in, float* terms) {
  if (!is_a_power(in.term)) return fill_altered(in, terms);
  // By blocks that stay in the processor's nearest memory; the kernel takes multiples of four.
  constexpr std::size_t block = 512;
  std::array<double, block> less, powers;
  for (std::size_t begin = 0; begin < in.count; begin += block) {
    const std::size_t end = std::min(begin + block, in.count), count = end - begin;
    fill_cosines(in, begin, end, terms + begin);
    for (std::size_t i = 0; i < block; ++i) less[i] = i < count ? 1.0 - terms[begin + i] : 1.0;
    run_powers({block, less.data(), less.data(), exponent_of(in), 0}, powers.data());
    for (std::size_t i = 0; i < count; ++i) terms[begin + i] = static_cast<float>(powers[i]);
  }
}

}  // namespace lobefit
