// A few Cycles closures whose parameters depend on the view: what a baked node group renders.
#pragma once

#include <array>
#include <utility>
#include <vector>

#include "closures/closure_kernel.h"
#include "closures/microfacet.h"
#include "closures/view_curve.h"
#include "reflectance/reflectance.h"

namespace lobefit {

using RgbCurve = std::array<ViewCurve, 3>;

// One GGX or Beckmann closure, in the terms of its node: Roughness and Anisotropy with the tangent
// in the plane of incidence, and the closure's normal n + bend wo, not normalised.
struct SpecularClosure {
  Distribution distribution = Distribution::ggx;
  ViewCurve roughness, anisotropy, bend;
  RgbCurve weight;
};

// The sum of a diffuse closure and some specular ones, each times its weight.
struct ClosureSet {
  RgbCurve diffuse;
  std::vector<SpecularClosure> specular;
};

// Cycles' sockets of a shape seen from wo (in the xz plane), and back. Roughness is sqrt(alpha),
// Anisotropy 1 - sqrt(alpha_x / alpha_y) or its negative counterpart; where one alpha would exceed
// 1, Cycles clips it. No bend reaches the viewer: the tilt has to be less than wo.x / wo.z.
struct ClosureSockets {
  double roughness;
  double anisotropy;
  double bend;
};
ClosureSockets to_sockets(const Shape& shape, const Vector3& wo);
Shape to_shape(const ClosureSockets& sockets, const Vector3& wo);

// Closures seen from one angle, with all curves read.
class ClosuresAtView {
 public:
  // The viewer at wo in the xz plane, x >= 0, above the horizon.
  ClosuresAtView(const ClosureSet& closures, const Vector3& wo);

  const Vector3& wo() const { return wo_; }

  // f cos(theta_i) for a light at wi above the horizon and the unit half vector of wi and wo.
  Rgb evaluate(const Vector3& wi, const Vector3& half) const;

 private:
  Vector3 wo_;
  Rgb diffuse_;
  std::vector<std::pair<Microfacet, Rgb>> specular_;  // with their weights
};

// Cycles drops a closure whose weight, the mean of its channels, is less than this.
inline constexpr double least_weight = 1e-5;

// f cos(theta_i) in 1/sr, as Cycles 4.2 and later evaluate it, for unit vectors toward the light
// (wi) and the viewer (wo), n = +z; 0 below the horizon. The curves are read once for all lights
// that a thread asks about one after the other for one view.
Reflectance closures_reflectance(ClosureSet closures);

}  // namespace lobefit
