// Cycles' GGX and Beckmann reflection closures, as Blender 4.0 and later evaluate them, with a bent
// normal and roughness of its own along the plane of incidence and across it.
#pragma once

#include <string_view>

#include "closures/microfacet_terms.h"
#include "measurement/vector3.h"

namespace lobefit {

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
  // G alone, also for a light between the closure's own horizon and that of the surface.
  double visible(const Vector3& wi) const;

  // What the formula with derivatives, closure_value in microfacet_terms.inc, takes.
  const MicrofacetTerms& terms() const { return terms_; }
  const Vector3& wo() const { return wo_; }

 private:
  Vector3 wo_;
  MicrofacetTerms terms_{};
};

}  // namespace lobefit
