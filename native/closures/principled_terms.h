// What the formula of the Principled BSDF takes; without Eigen, so that the kernel for AVX2 can
// include it.
#pragma once

namespace lobefit {

// The sockets that all channels share, in the form that is fitted: reflectance_root is
// (ior - 1) / (ior + 1), the square root of F0. The largest channel of the specular tint is one of
// them, since it dims the diffuse part of every channel.
struct SharedSockets {
  double metallic;
  double roughness;
  double reflectance_root;
  double brightest_tint;
};

// What a channel is differentiated by: the shared sockets, ln roughness in place of roughness, and
// two of its own.
struct PrincipledSlopes {
  enum { metallic, log_roughness, reflectance_root, brightest_tint, base_color, specular_tint };
  static constexpr int shared = 4, count = 6;
};

// A dielectric of reflectance_root.
struct DielectricTerms {
  double root;
  double f0;
  double excess;               // ior^2 - 1
  double half_excess_by_root;  // half its derivative by root
};

// What does not depend on the light.
struct PrincipledTerms {
  double metallic;
  double alpha2;
  double scale;  // 1 / (2 pi n.wo); 0 of a mirror
  double masking_o, masking_o_by_log_roughness;
  DielectricTerms dielectric;
  double diffuse;  // what is left of a white diffuse part, in 1/sr
  double diffuse_by[PrincipledSlopes::shared];
};

// What it needs of a light above the horizon beside the viewer's n.wo: the cosines n.wi and
// wi.wh > 0, and the squared sine and cosine between normal and half vector wh.
template <typename Number>
struct FacetLight {
  Number n_wi, wi_h, sin2_h, cos2_h;
};

// Of a viewer above the horizon.
PrincipledTerms principled_terms(const SharedSockets& sockets, double n_wo);

}  // namespace lobefit
