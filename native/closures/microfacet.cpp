#include "closures/microfacet.h"

#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "closures/microfacet_terms.inc"
#include "measurement/input_error.h"

namespace lobefit {
namespace {

constexpr std::array<std::pair<Distribution, std::string_view>, 2> names = {
    {{Distribution::ggx, "ggx"}, {Distribution::beckmann, "beckmann"}}};

}  // namespace

std::string_view name_of(Distribution distribution) {
  return names[static_cast<std::size_t>(distribution)].second;
}

Distribution distribution_named(std::string_view name) {
  for (const auto& [distribution, known] : names) {
    if (known == name) return distribution;
  }
  throw InputError("distribution: expected ggx or beckmann, found '" + std::string(name) + "'.");
}

Microfacet::Microfacet(Distribution distribution, const Shape& shape, const Vector3& wo) : wo_(wo) {
  MicrofacetTerms& m = terms_;
  m.distribution = distribution;
  m.tilt = shape.tilt;
  m.stretch2 = 1 + square(m.tilt);
  m.inverse_stretch2 = 1 / m.stretch2;
  m.tilt_by_stretch2 = m.tilt * m.inverse_stretch2;
  m.alpha_x2 = std::exp(2 * shape.log_alpha_x);
  m.alpha_y2 = std::exp(2 * shape.log_alpha_y);
  m.inverse_x2 = 1 / m.alpha_x2;
  m.inverse_y2 = 1 / m.alpha_y2;
  // n'.w = (w.z + tilt w.x) / sqrt(stretch2).
  const double above = wo.z() + m.tilt * wo.x();
  if (!(above > 0)) return;
  m.scale = std::sqrt(m.stretch2 * m.inverse_x2 * m.inverse_y2) / (4 * pi * above);
  m.scale_by_tilt = m.tilt_by_stretch2 - wo.x() / above;
  if (distribution == Distribution::beckmann) {
    m.scale *= square(m.stretch2);
    m.scale_by_tilt += 4 * m.tilt_by_stretch2;
  }
  const ByShape<double> masked = masked_height<true, double>(
      distribution, elevation(m, Direction<double>{wo.x(), wo.y(), wo.z()}, above));
  m.masking_o = {masked.value / above, masked.by_log_alpha_x / above, masked.by_log_alpha_y / above,
                 (masked.by_tilt - masked.value * wo.x() / above) / above};
}

double Microfacet::visible(const Vector3& wi) const {
  const double height = std::abs(wi.z() + terms_.tilt * wi.x());
  const double masked =
      masked_height<false, double>(
          terms_.distribution, elevation(terms_, Direction<double>{wi.x(), wi.y(), wi.z()}, height))
          .value;
  return height / (masked + terms_.masking_o.value * height);
}

double Microfacet::evaluate(const Vector3& wi, const Vector3& half) const {
  return closure_value<false, double>(terms_, {wi.x(), wi.y(), wi.z()},
                                      {half.x(), half.y(), half.z()})
      .value;
}

}  // namespace lobefit
