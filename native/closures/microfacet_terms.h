// What of a closure's formula does not depend on the light; without Eigen, so that the kernel for
// AVX2 can include it.
#pragma once

namespace lobefit {

enum class Distribution { ggx, beckmann };

// An amount, and its derivatives by the shape of a closure.
template <typename Number>
struct ByShape {
  Number value{}, by_log_alpha_x{}, by_log_alpha_y{}, by_tilt{};
};

// In single precision or in double.
template <typename Scalar>
struct MicrofacetTermsOf {
  Distribution distribution;
  Scalar tilt;
  Scalar stretch2;  // 1 + tilt^2, the squared length of n + tilt x
  Scalar inverse_stretch2, tilt_by_stretch2;
  Scalar alpha_x2, alpha_y2;
  Scalar inverse_x2, inverse_y2;
  Scalar scale;               // all factors that do not depend on the light; 0 of a viewer below
  Scalar scale_by_tilt;       // derivative of its logarithm
  ByShape<Scalar> masking_o;  // what masking adds for the viewer

  template <typename Other>
  MicrofacetTermsOf<Other> as() const {
    const auto in = [](Scalar v) { return static_cast<Other>(v); };
    return {distribution,
            in(tilt),
            in(stretch2),
            in(inverse_stretch2),
            in(tilt_by_stretch2),
            in(alpha_x2),
            in(alpha_y2),
            in(inverse_x2),
            in(inverse_y2),
            in(scale),
            in(scale_by_tilt),
            {in(masking_o.value), in(masking_o.by_log_alpha_x), in(masking_o.by_log_alpha_y),
             in(masking_o.by_tilt)}};
  }
};
using MicrofacetTerms = MicrofacetTermsOf<double>;

}  // namespace lobefit
