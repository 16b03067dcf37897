#include "reflectance/fresnel.h"

#include <algorithm>
#include <cmath>

namespace lobefit {

// With g^2 = ior^2 - 1 + c^2 the amplitudes are r_s = (g - c) / (g + c) and
// r_p = r_s (c (g + c) - 1) / (c (g - c) + 1), and R_F = (r_s^2 + r_p^2) / 2. The difference g - c
// is formed as (ior^2 - 1) / (g + c), which loses nothing when ior is close to 1.
FresnelReflectance fresnel_reflectance(double cosine, double ior) {
  const double c = std::clamp(cosine, 0.0, 1.0);
  const double excess = (ior - 1) * (ior + 1);
  if (!(excess > 0)) return {0, 0};
  const double g = std::sqrt(excess + c * c);
  const double sum = g + c, difference = excess / sum;
  const double s = difference / sum;
  const double upper = c * sum - 1, lower = c * difference + 1;
  const double ratio = upper / lower;
  const double p = s * ratio;
  const double g_slope = ior / g;
  const double s_slope = 2 * c / (sum * sum) * g_slope;
  const double ratio_slope = c * (lower - upper) / (lower * lower) * g_slope;
  return {(s * s + p * p) / 2, s * s_slope + p * (s_slope * ratio + s * ratio_slope)};
}

}  // namespace lobefit
