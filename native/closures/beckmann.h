// Cycles' Beckmann reflection closure, as Blender 4.0 and later evaluate it.
#pragma once

#include <Eigen/Geometry>
#include <cmath>

#include "measurement/vector3.h"

namespace lobefit {

// A unit normal, a unit tangent at right angles to it, and the roughness along the tangent and
// across it, each in (0, 1].
struct Beckmann {
  Vector3 normal;
  Vector3 tangent;
  double alpha_x;
  double alpha_y;
};

// Cycles' rational approximation of Smith's Lambda for the Beckmann distribution (Walter et al.
// 2007, eq. 15), for q = (alpha tan theta)^2.
inline double beckmann_lambda(double q) {
  if (q < 0.39) return 0;
  const double c = 1 / std::sqrt(q);
  return (1 - 1.259 * c + 0.396 * c * c) / (3.535 * c + 2.181 * c * c);
}

// f cos(theta_i) in 1/sr for unit vectors toward the light (wi) and the viewer (wo): D G / (4 n.wo)
// with height-correlated masking G = 1 / (1 + Lambda(wi) + Lambda(wo)); 0 unless both are above the
// closure's own horizon.
inline double evaluate_beckmann(const Beckmann& closure, const Vector3& wi, const Vector3& wo) {
  const Vector3 bitangent = closure.normal.cross(closure.tangent);
  const auto slopes = [&](const Vector3& w) {
    const double z = w.dot(closure.normal);
    const double x = closure.alpha_x * w.dot(closure.tangent) / z;
    const double y = closure.alpha_y * w.dot(bitangent) / z;
    return x * x + y * y;
  };
  const double cos_i = wi.dot(closure.normal), cos_o = wo.dot(closure.normal);
  if (!(cos_i > 0 && cos_o > 0)) return 0;
  const Vector3 half = (wi + wo).normalized();
  const double z = half.dot(closure.normal);
  const double x = half.dot(closure.tangent) / (closure.alpha_x * z);
  const double y = half.dot(bitangent) / (closure.alpha_y * z);
  const double distribution =
      std::exp(-(x * x + y * y)) / (pi * closure.alpha_x * closure.alpha_y * z * z * z * z);
  const double masking = 1 / (1 + beckmann_lambda(slopes(wi)) + beckmann_lambda(slopes(wo)));
  return distribution * masking / (4 * cos_o);
}

}  // namespace lobefit
