// Compiled without vectors of the compiler's making (CMakeLists.txt).
#include <array>
#include <string>
#include <utility>

#include "measurement/input_error.h"
#include "preview/phong_terms.inc"

namespace lobefit {

PhongTerm phong_term_named(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, PhongTerm>, 5> known = {
      {{"exact", PhongTerm::exact},
       {"half-vector", PhongTerm::half_vector},
       {"dot", PhongTerm::dot},
       {"difference", PhongTerm::difference},
       {"cross", PhongTerm::cross}}};
  for (const auto& [each, term] : known) {
    if (each == name) return term;
  }
  throw InputError("term: expected exact, half-vector, dot, difference or cross, found '" +
                   std::string(name) + "'.");
}

void phong_terms_one_by_one(const PhongTermInput& in, float* terms) {
  if (!is_a_power(in.term)) return fill_altered(in, terms);
  fill_cosines(in, 0, in.count, terms);
  const auto exponent = static_cast<float>(exponent_of(in));
  for (std::size_t i = 0; i < in.count; ++i) terms[i] = std::pow(terms[i], exponent);
}

}  // namespace lobefit
