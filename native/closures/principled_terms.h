// The formula of the Principled BSDF for any scalar type, so that values and derivatives cannot
// differ: double for evaluation, a dual number for fitting.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "measurement/vector3.h"
#include "reflectance/fresnel.h"

namespace lobefit {

// What the formula needs of a pair of directions above the horizon: the cosines n.wi, n.wo, wi.wh,
// and the squared sine and cosine between normal and half vector wh.
struct FacetGeometry {
  double n_wi;
  double n_wo;
  double wi_h;
  double sin2_h;
  double cos2_h;
};

FacetGeometry facet_geometry(const Vector3& wi, const Vector3& wo);

// How far the albedo of a rough dielectric toward the viewer has gone from its F0 (0) to 1 (1):
// the mean of (F - F0) / (1 - F0) over the visible GGX normals, those that reflect below the
// horizon counting 0. Cycles reads it from a table with 16 nodes each in roughness, n.wo and
// sqrt((ior - 1) / (ior + 1)), linear between them (the last node holding what belongs to .99);
// the interpolation shows, so the same nodes are computed here.
class CoatTable {
 public:
  static constexpr int nodes = 16;

  // The one table there is; computed by quadrature when first asked for.
  static const CoatTable& instance();

  template <typename T>
  T operator()(const T& roughness, double n_wo, const T& root_ior) const;

 private:
  CoatTable();
  double node(std::ptrdiff_t roughness, int n_wo, int root_ior) const {
    return values_[static_cast<std::size_t>((roughness * nodes + n_wo) * nodes + root_ior)];
  }
  std::array<float, std::size_t{nodes} * nodes * nodes> values_;
};

// The sockets that all channels share, in the form that is fitted: reflectance_root is
// (ior - 1) / (ior + 1), the square root of F0. The largest channel of the specular tint is one of
// them, since it dims the diffuse part of every channel.
template <typename T>
struct SharedSockets {
  T metallic;
  T roughness;
  T reflectance_root;
  T brightest_tint;
};

inline double value_of(double x) { return x; }
template <typename Dual>
double value_of(const Dual& x) {
  return x.a;
}

template <typename T>
T mix(const T& from, const T& to, const T& weight) {
  return from + (to - from) * weight;
}

template <typename T>
T saturate(const T& x) {
  return value_of(x) <= 0 ? T(0) : value_of(x) >= 1 ? T(1) : x;
}

inline double dielectric_fresnel(double cosine, double ior) {
  return fresnel_reflectance(cosine, ior).value;
}
template <typename Dual>
Dual dielectric_fresnel(double cosine, const Dual& ior) {
  const FresnelReflectance fresnel = fresnel_reflectance(cosine, ior.a);
  return Dual(fresnel.value, fresnel.derivative * ior.v);
}

template <typename T>
T square(const T& x) {
  return x * x;
}

// How far Fresnel's reflectance has gone from F0 = root^2 (0) to 1 (1).
template <typename T>
T schlick_weight(const T& root, double cosine) {
  const T f0 = square(root);
  const T fresnel = dielectric_fresnel(cosine, T((1.0 + root) / (1.0 - root)));
  return saturate(T((fresnel - f0) / (1.0 - f0)));
}

template <typename T>
T CoatTable::operator()(const T& roughness, double n_wo, const T& root_ior) const {
  const auto locate = [](double x) {
    return std::clamp(static_cast<int>(x * (nodes - 1)), 0, nodes - 2);
  };
  const int r = locate(value_of(roughness)), c = locate(n_wo), i = locate(value_of(root_ior));
  const double across = n_wo * (nodes - 1) - c;
  const auto at = [&](int dr, int di) {
    return mix(node(r + dr, c, i + di), node(r + dr, c + 1, i + di), across);
  };
  const T along = root_ior * double(nodes - 1) - double(i);
  const T low = at(0, 0) + (at(0, 1) - at(0, 0)) * along;
  const T high = at(1, 0) + (at(1, 1) - at(1, 0)) * along;
  return mix(low, high, T(roughness * double(nodes - 1) - double(r)));
}

// Masking of GGX, 1 + 2 Lambda, for a light or a viewer at the angle of `cosine` to the normal.
template <typename T>
T ggx_masking(const T& roughness, double cosine) {
  using std::sqrt;
  const double tangent2 = (1 - square(cosine)) / square(cosine);
  return sqrt(1.0 + square(square(roughness)) * tangent2);
}

// D G / (4 n.wo) of GGX; view_masking is that of n.wo.
template <typename T>
T ggx_lobe(const T& roughness, const T& view_masking, const FacetGeometry& at) {
  const T alpha2 = square(square(roughness));
  // Cycles takes anything narrower for a mirror.
  if (value_of(alpha2) <= 2e-10) return T(0);
  const T spread = at.sin2_h + alpha2 * at.cos2_h;
  // With Lambda = (masking - 1) / 2, G = 1 / (1 + Lambda_i + Lambda_o) = 2 / (sum of maskings).
  return alpha2 /
         (square(spread) * (ggx_masking(roughness, at.n_wi) + view_masking) * (2 * pi * at.n_wo));
}

// Schlick's Fresnel term through base_color at normal incidence and base_color x tint, of what it
// would have been, at 82 degrees (cosine 1/7).
template <typename T>
T metal_fresnel(const T& base_color, const T& tint, double cosine) {
  constexpr double edge = 6.0 / 7, edge5 = edge * edge * edge * edge * edge;
  const double opposite = 1 - cosine;
  const double opposite5 = opposite * opposite * opposite * opposite * opposite;
  const T dip = (base_color + (1.0 - base_color) * edge5) * (1.0 - tint) * (7 / (edge5 * edge));
  return saturate(
      T(base_color + (1.0 - base_color) * opposite5 - dip * (cosine * opposite5 * opposite)));
}

// What all lights seen from one view angle share.
template <typename T>
struct PrincipledAtView {
  T masking;
  T diffuse;  // what is left of a white diffuse part, in 1/sr
};

template <typename T>
PrincipledAtView<T> principled_at_view(const SharedSockets<T>& shared, double n_wo) {
  using std::sqrt;
  const T& root = shared.reflectance_root;
  // At ior = 1 there is no coat, and the root has no derivative.
  const T coat =
      value_of(root) > 0 ? CoatTable::instance()(shared.roughness, n_wo, T(sqrt(root))) : T(0);
  const T coat_albedo = mix(T(square(root) * shared.brightest_tint), T(1), coat);
  return {ggx_masking(shared.roughness, n_wo),
          (1.0 - shared.metallic) * saturate(T(1.0 - coat_albedo)) / pi};
}

// What all channels share at one light.
template <typename T>
struct PrincipledAtLight {
  T metal;       // the lobe's part that a metal reflects by its colours
  T dielectric;  // the part that a dielectric reflects by its tint
  T untinted;    // and the part that no socket colours
  T diffuse;     // what a white diffuse part reflects
  double wi_h;
};

// `schlick` is schlick_weight there and `lobe` ggx_lobe.
template <typename T>
PrincipledAtLight<T> principled_at_light(const SharedSockets<T>& shared,
                                         const PrincipledAtView<T>& view, const FacetGeometry& at,
                                         const T& schlick, const T& lobe) {
  const T metal = shared.metallic * lobe;
  const T dielectric = lobe - metal;
  const T untinted = dielectric * schlick;
  return {metal, square(shared.reflectance_root) * (dielectric - untinted), untinted,
          view.diffuse * at.n_wi, at.wi_h};
}

template <typename T>
PrincipledAtLight<T> principled_at_light(const SharedSockets<T>& shared,
                                         const PrincipledAtView<T>& view, const FacetGeometry& at) {
  return principled_at_light(shared, view, at, schlick_weight(shared.reflectance_root, at.wi_h),
                             ggx_lobe(shared.roughness, view.masking, at));
}

// f cos of a channel whose metal reflects `fresnel` of the lobe.
template <typename T, typename Colour>
T principled_sum(const PrincipledAtLight<T>& light, const Colour& fresnel, const Colour& base_color,
                 const Colour& specular_tint) {
  return light.metal * fresnel + light.dielectric * specular_tint + light.untinted +
         light.diffuse * base_color;
}

// f cos of a channel.
template <typename T>
T principled_channel(const PrincipledAtLight<T>& light, const T& base_color,
                     const T& specular_tint) {
  return principled_sum(light, metal_fresnel(base_color, specular_tint, light.wi_h), base_color,
                        specular_tint);
}

}  // namespace lobefit
