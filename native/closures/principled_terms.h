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
  double node(int roughness, int n_wo, int root_ior) const {
    return values_[static_cast<std::size_t>((roughness * nodes + n_wo) * nodes + root_ior)];
  }
  std::array<float, nodes * nodes * nodes> values_;
};

// The sockets, in the form that is fitted: reflectance_root is (ior - 1) / (ior + 1), the square
// root of F0.
template <typename T>
struct PrincipledSockets {
  std::array<T, 3> base_color;
  std::array<T, 3> specular_tint;
  T metallic;
  T roughness;
  T reflectance_root;
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
  const auto [value, derivative] = fresnel_reflectance(cosine, ior.a);
  return Dual(value, derivative * ior.v);
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

// D G / (4 n.wo) of GGX.
template <typename T>
T ggx_lobe(const T& roughness, const FacetGeometry& at) {
  const T alpha2 = square(square(roughness));
  // Cycles takes anything narrower for a mirror.
  if (value_of(alpha2) <= 2e-10) return T(0);
  const auto masking = [&](double cosine) {
    using std::sqrt;
    return sqrt(1.0 + alpha2 * ((1 - square(cosine)) / square(cosine)));
  };
  const T spread = at.sin2_h + alpha2 * at.cos2_h;
  // With Lambda = (masking - 1) / 2, G = 1 / (1 + Lambda_i + Lambda_o) = 2 / (sum of maskings).
  return alpha2 / (square(spread) * (masking(at.n_wi) + masking(at.n_wo)) * (2 * pi * at.n_wo));
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

template <typename T>
std::array<T, 3> principled_terms(const PrincipledSockets<T>& sockets, const FacetGeometry& at) {
  using std::sqrt;
  const T& root = sockets.reflectance_root;
  const T f0 = square(root);
  const T schlick = schlick_weight(root, at.wi_h);
  // At ior = 1 there is no coat, and the root has no derivative.
  const T coat =
      value_of(root) > 0 ? CoatTable::instance()(sockets.roughness, at.n_wo, T(sqrt(root))) : T(0);
  const auto& tint = sockets.specular_tint;
  const auto brightest = std::max_element(
      tint.begin(), tint.end(), [](const T& a, const T& b) { return value_of(a) < value_of(b); });
  const T coat_albedo = mix(T(f0 * *brightest), T(1), coat);
  const T dielectric = 1.0 - sockets.metallic;
  const T lobe = ggx_lobe(sockets.roughness, at);
  const T diffuse = dielectric * saturate(T(1.0 - coat_albedo)) * (at.n_wi / pi);
  std::array<T, 3> result;
  for (std::size_t c = 0; c < 3; ++c) {
    const T& base = sockets.base_color[c];
    const T reflected = sockets.metallic * metal_fresnel(base, tint[c], at.wi_h) +
                        dielectric * mix(T(f0 * tint[c]), T(1), schlick);
    result[c] = lobe * reflected + diffuse * base;
  }
  return result;
}

}  // namespace lobefit
