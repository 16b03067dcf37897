// The Fresnel reflectance of a dielectric.
#pragma once

#include <algorithm>
#include <cmath>

namespace lobefit {

// A value and its derivatives by the index of refraction.
struct FresnelReflectance {
  double value;
  double derivative;
  double second_derivative;
};

// R_F for unpolarised light that arrives from outside at an angle of the given cosine (0..1) on a
// dielectric of index of refraction ior >= 1 (Cook and Torrance 1982, eq. for k = 0). Exact to
// rounding also where ior - 1 is tiny: R_F is then the square of small, directly formed numbers.
// It is defined here so that what a caller leaves unused is not computed.
//
// With g^2 = ior^2 - 1 + c^2 the amplitudes are r_s = (g - c) / (g + c) and
// r_p = r_s (c (g + c) - 1) / (c (g - c) + 1), and R_F = (r_s^2 + r_p^2) / 2. The difference g - c
// is formed as (ior^2 - 1) / (g + c), which loses nothing when ior is close to 1.
inline FresnelReflectance fresnel_reflectance(double cosine, double ior) {
  const double c = std::clamp(cosine, 0.0, 1.0);
  const double excess = (ior - 1) * (ior + 1);
  if (!(excess > 0)) return {0, 0, 0};
  const double g = std::sqrt(excess + c * c);
  const double sum = g + c, difference = excess / sum;
  const double upper = c * sum - 1, lower = c * difference + 1;
  // Value and derivatives by g of r_s, of r_p / r_s and of r_p.
  const double s = difference / sum, s_g = 2 * c / (sum * sum), s_gg = -2 * s_g / sum;
  const double ratio = upper / lower, ratio_g = c * (lower - upper) / (lower * lower),
               ratio_gg = -2 * c * ratio_g / lower;
  const double p = s * ratio, p_g = s_g * ratio + s * ratio_g,
               p_gg = s_gg * ratio + 2 * s_g * ratio_g + s * ratio_gg;
  const double by_g = s * s_g + p * p_g, by_gg = s_g * s_g + s * s_gg + p_g * p_g + p * p_gg;
  const double g_slope = ior / g, g_curvature = (c * c - 1) / (g * g * g);
  return {(s * s + p * p) / 2, by_g * g_slope, by_gg * g_slope * g_slope + by_g * g_curvature};
}

}  // namespace lobefit
