// Cycles' GGX and Beckmann reflection closures, as Blender 4.0 and later evaluate them, with a bent
// normal and roughness of its own along the plane of incidence and across it.
#pragma once

#include <string_view>

#include "measurement/vector3.h"

namespace lobefit {

enum class Distribution { ggx, beckmann };

// "ggx", "beckmann".
std::string_view name_of(Distribution distribution);
// Throws InputError for any other name.
Distribution distribution_named(std::string_view name);

// What a closure looks like from one view angle: ln of the roughness alpha = Roughness^2 in the
// plane of incidence (x) and across it (y), and the tangent of the angle by which its normal is
// bent in that plane, toward the viewer.
struct Shape {
  double log_alpha_x = 0;
  double log_alpha_y = 0;
  double tilt = 0;
};

// f cos(theta_i) in 1/sr, and the derivatives of its logarithm.
struct ShapeValue {
  double value = 0;
  double by_log_alpha_x = 0;
  double by_log_alpha_y = 0;
  double by_tilt = 0;
};

// A closure seen under one view angle from the normal n = +z, the viewer in the xz plane at x > 0.
//
//   f cos = D(h) G(wi, wo) / (4 n'.wo),  G = 1 / (1 + Lambda(wi) + Lambda(wo)),
//
// n' the bent normal, height-correlated masking (Heitz 2014, eq. 99); 0 unless light and viewer are
// both above the closure's own horizon.
class Microfacet {
 public:
  Microfacet(Distribution distribution, const Shape& shape, const Vector3& wo);

  // For a light at wi and the half vector of wi and wo, both of unit length.
  double evaluate(const Vector3& wi, const Vector3& half) const;
  ShapeValue evaluate_with_derivatives(const Vector3& wi, const Vector3& half) const;

 private:
  // Smith's slopes (alpha tan theta)^2 of a direction, and its derivatives.
  struct Slope {
    double value, by_log_alpha_x, by_log_alpha_y, by_tilt;
  };
  // What masking adds for one direction, and its derivative by the slope.
  struct Masking {
    double value, by_slope;
  };
  Slope slope(const Vector3& w) const;
  Masking masking(double slope) const;
  template <bool derivatives>
  ShapeValue compute(const Vector3& wi, const Vector3& half) const;

  Distribution distribution_;
  double tilt_;
  double stretch2_;  // 1 + tilt^2
  double alpha_x2_, alpha_y2_;
  double inverse_x2_, inverse_y2_;
  double scale_;  // all factors that do not depend on the light
  double scale_by_tilt_;
  Slope slope_o_{};
  Masking masking_o_{};
};

}  // namespace lobefit
