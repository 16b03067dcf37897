// What of a closure's formula does not depend on the light; without Eigen, so that the kernel for
// AVX2 can include it.
#pragma once

namespace lobefit {

enum class Distribution { ggx, beckmann };

// Smith's slopes (alpha tan theta)^2 of a direction, and their derivatives.
template <typename Number>
struct MaskingSlope {
  Number value, by_log_alpha_x, by_log_alpha_y, by_tilt;
};

// What masking adds for a direction, and its derivative by the slope.
template <typename Number>
struct Masking {
  Number value, by_slope;
};

// f cos(theta_i) in 1/sr, and the derivatives of its logarithm.
template <typename Number>
struct ClosureValue {
  Number value{}, by_log_alpha_x{}, by_log_alpha_y{}, by_tilt{};
};

struct MicrofacetTerms {
  Distribution distribution;
  double tilt;
  double stretch2;  // 1 + tilt^2, the squared length of n + tilt x
  double inverse_stretch2, tilt_by_stretch2;
  double alpha_x2, alpha_y2;
  double inverse_x2, inverse_y2;
  double scale;          // all factors that do not depend on the light; 0 of a viewer below
  double scale_by_tilt;  // derivative of its logarithm
  MaskingSlope<double> slope_o;
  Masking<double> masking_o;
};

}  // namespace lobefit
