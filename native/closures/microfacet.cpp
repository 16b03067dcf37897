#include "closures/microfacet.h"

#include <array>
#include <cmath>
#include <string>
#include <utility>

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

Microfacet::Microfacet(Distribution distribution, const Shape& shape, const Vector3& wo)
    : distribution_(distribution),
      tilt_(shape.tilt),
      stretch2_(1 + tilt_ * tilt_),
      alpha_x2_(std::exp(2 * shape.log_alpha_x)),
      alpha_y2_(std::exp(2 * shape.log_alpha_y)),
      inverse_x2_(1 / alpha_x2_),
      inverse_y2_(1 / alpha_y2_) {
  // The length of n + tilt x is the root of stretch2: n'.w = (w.z + tilt w.x) / sqrt(stretch2).
  const double above = wo.z() + tilt_ * wo.x();
  if (!(above > 0)) {
    scale_ = scale_by_tilt_ = 0;
    return;
  }
  scale_ = std::sqrt(stretch2_ * inverse_x2_ * inverse_y2_) / (4 * pi * above);
  scale_by_tilt_ = tilt_ / stretch2_ - wo.x() / above;
  slope_o_ = slope(wo);
  masking_o_ = masking(slope_o_.value);
}

Microfacet::Slope Microfacet::slope(const Vector3& w) const {
  const double above = 1 / (w.z() + tilt_ * w.x());
  const double along = (w.x() - tilt_ * w.z()) * above;
  const double across = w.y() * above;
  const double x = alpha_x2_ * along * along, y = alpha_y2_ * across * across * stretch2_;
  const double plane2 = (w.x() * w.x() + w.z() * w.z()) * above * above;
  return {x + y, 2 * x, 2 * y,
          -2 * alpha_x2_ * along * plane2 + 2 * y * (tilt_ / stretch2_ - w.x() * above)};
}

// Of GGX, 1 + Lambda(wi) + Lambda(wo) is half the sum of two roots: each adds its own half.
Microfacet::Masking Microfacet::masking(double slope) const {
  if (distribution_ == Distribution::ggx) {
    const double root = std::sqrt(1 + slope);
    return {root / 2, 0.25 / root};
  }
  if (slope < 0.39) return {0.5, 0};
  const double c = 1 / std::sqrt(slope);
  const double above = 1 - 1.259 * c + 0.396 * c * c, below = 3.535 * c + 2.181 * c * c;
  const double by_c =
      ((-1.259 + 0.792 * c) * below - above * (3.535 + 4.362 * c)) / (below * below);
  return {0.5 + above / below, -0.5 * by_c * c / slope};
}

template <bool derivatives>
ShapeValue Microfacet::compute(const Vector3& wi, const Vector3& half) const {
  if (!(scale_ > 0 && wi.z() + tilt_ * wi.x() > 0)) return {};
  const double a = half.z() + tilt_ * half.x(), b = half.x() - tilt_ * half.z();
  const double x = b * b * inverse_x2_, y = half.y() * half.y() * inverse_y2_;
  const Slope slope_i = slope(wi);
  const Masking masking_i = masking(slope_i.value);
  const double hidden = 1 / (masking_i.value + masking_o_.value);
  ShapeValue result;
  double by_x, by_y, by_tilt;  // of ln D
  if (distribution_ == Distribution::ggx) {
    const double spread = (x + a * a) / stretch2_ + y;
    const double inverse = 1 / spread;
    result.value = scale_ * hidden * inverse * inverse;
    if constexpr (!derivatives) return result;
    by_x = 4 * inverse * x / stretch2_;
    by_y = 4 * inverse * y;
    by_tilt = 4 * inverse *
              ((x + a * a) * tilt_ / stretch2_ + b * half.z() * inverse_x2_ - a * half.x()) /
              stretch2_;
  } else {
    const double inverse = 1 / (a * a);
    const double exponent = (x + y * stretch2_) * inverse;
    result.value =
        scale_ * hidden * std::exp(-exponent) * (inverse * inverse) * stretch2_ * stretch2_;
    if constexpr (!derivatives) return result;
    by_x = 2 * x * inverse;
    by_y = 2 * y * stretch2_ * inverse;
    by_tilt = 2 * (b * half.z() * inverse_x2_ - y * tilt_) * inverse + 2 * exponent * half.x() / a -
              4 * half.x() / a + 4 * tilt_ / stretch2_;
  }
  const auto masked = [&](double slope_i_by, double slope_o_by) {
    return hidden * (masking_i.by_slope * slope_i_by + masking_o_.by_slope * slope_o_by);
  };
  result.by_log_alpha_x = by_x - 1 - masked(slope_i.by_log_alpha_x, slope_o_.by_log_alpha_x);
  result.by_log_alpha_y = by_y - 1 - masked(slope_i.by_log_alpha_y, slope_o_.by_log_alpha_y);
  result.by_tilt = by_tilt + scale_by_tilt_ - masked(slope_i.by_tilt, slope_o_.by_tilt);
  return result;
}

double Microfacet::evaluate(const Vector3& wi, const Vector3& half) const {
  return compute<false>(wi, half).value;
}

ShapeValue Microfacet::evaluate_with_derivatives(const Vector3& wi, const Vector3& half) const {
  return compute<true>(wi, half);
}

}  // namespace lobefit
