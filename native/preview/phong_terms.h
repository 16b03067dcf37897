// Phong's specular term and what is cheaper than it, for distant lights and viewers.
//
// The exact term is max(wr.wo, 0)^s where n.wi > 0. Its alterations are
//
//   half_vector   (n.wh)^{4s}: wh is the same everywhere (Blinn 1977);
//   dot           max(1 - beta lambda, 0)^gamma, lambda = 1 - wr.wo,
//   difference    the same with lambda = |wr - wo|^2 / 2,
//   cross         the same with lambda = |wr x wo|^2 / 2, where wr.wo > 0,
//
// with beta gamma = s and gamma a power of two, so that the power is a few squares (Lyon, "Phong
// shading reformulation for hardware renderer simplification", 1993). For unit vectors the first
// two lambdas are equal; that of the difference needs no unit vectors.
#pragma once

#include <cstddef>
#include <string_view>

#include "measurement/vector3.h"

namespace lobefit {

enum class PhongTerm { exact, half_vector, dot, difference, cross };

// "exact", "half-vector", "dot", "difference", "cross"; throws InputError for another name.
PhongTerm phong_term_named(std::string_view name);

// What is evaluated at `count` normals, by components; light and viewer are of unit length.
struct PhongTermInput {
  PhongTerm term;
  double exponent;  // s > 0
  int squares;      // gamma is 2^squares, for the three last terms
  Vector3 light, viewer;
  std::size_t count;
  const float* normal[3];
};

// One value a normal, in single precision: one after the other by std::pow and plain arithmetic, or
// in lanes, where the powers are those of the fit's kernel and the rest is what the compiler makes
// of the loop.
void phong_terms_one_by_one(const PhongTermInput& input, float* terms);
void phong_terms_in_lanes(const PhongTermInput& input, float* terms);

}  // namespace lobefit
