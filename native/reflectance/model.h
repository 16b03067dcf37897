// The single-lobe models of Nielsen, Frisvad, Conradsen and Aanaes, "Addressing Grazing Angle
// Reflections in Phong Models" (2014), equations 1 to 3:
//
//   (1) modified Phong        rho_d/pi + rho_s (s+2)/(2 pi) (wr.wo)^s
//   (2) modified Blinn-Phong  rho_d/pi + rho_s (s+8)/(8 pi) (wh.n)^s
//   (3) interpolated          rho_d/pi + k_s ((1-alpha)(wr.wo) + alpha (wh.n)^4)^s
//
// each with the specular term times the Fresnel reflectance R_F(wi.wh, eta), or without.
#pragma once

#include <optional>
#include <string_view>

#include "measurement/half_difference.h"
#include "measurement/vector3.h"

namespace lobefit {

enum class ModelKind { modified_phong, modified_blinn_phong, interpolated };

// "modified-phong", "modified-blinn-phong", "interpolated".
std::string_view name_of(ModelKind kind);
// Throws InputError for any other name.
ModelKind model_named(std::string_view name);

// diffuse is rho_d; specular is rho_s of (1) and (2), k_s of (3); exponent is s > 0, three equal
// numbers where the channels share it; interpolation is alpha in [0, 1], of (3) alone; ior is eta
// >= 1, or nothing for the model without Fresnel.
struct Parameters {
  ModelKind kind = ModelKind::interpolated;
  Rgb diffuse = Rgb::Zero();
  Rgb specular = Rgb::Zero();
  Rgb exponent = Rgb::Constant(1);
  double interpolation = 0;
  std::optional<double> ior;
};

// All three models are k_s R_F base^s of one base (Lobe below): modified Phong has alpha = 0,
// modified Blinn-Phong alpha = 1 and a quarter of its exponent.
Parameters as_interpolated(const Parameters& parameters);

// The factor that turns rho_s into k_s: (s+2)/(2 pi), (s+8)/(8 pi) or 1.
double specular_scale(ModelKind kind, double exponent);

// Where a pair of directions stands in the lobe. base = 1 - u with
//   u = (1 - alpha) u_phong + alpha u_blinn,  u_phong = 1 - wr.wo,  u_blinn = 1 - (wh.n)^4.
// Both are formed from sines of half-difference angles, without cancellation at the peak:
//   u_phong = 2 sin^2 theta_h (cos^2 theta_d + sin^2 theta_d cos^2 phi_d),
//   u_blinn = sin^2 theta_h (1 + cos^2 theta_h).
struct LobeCoordinates {
  double u_phong;
  double u_blinn;
  double cos_theta_d;
};

LobeCoordinates lobe_coordinates(const HalfDifference& point);
// The same from sine and cosine of theta_h, cos theta_d and along = sin theta_d cos phi_d.
inline LobeCoordinates lobe_coordinates(double sin_h, double cos_h, double cos_d, double along) {
  const double sin2_h = sin_h * sin_h;
  return {2 * sin2_h * (cos_d * cos_d + along * along), sin2_h * (1 + cos_h * cos_h), cos_d};
}

// base^s, 0 where base <= 0.
double lobe_power(const LobeCoordinates& at, double interpolation, double exponent);

// f in 1/sr, without the cosine.
Rgb evaluate_model(const Parameters& parameters, const HalfDifference& point);
// The same for unit vectors in the local frame (n = +z); 0 below the horizon.
Rgb evaluate_model(const Parameters& parameters, const Vector3& wi, const Vector3& wo);

}  // namespace lobefit
