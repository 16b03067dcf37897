// The classic reflection model of Phong (1975) and Blinn: for lights m of intensities i_d and i_s,
//
//   I = k_a i_a + sum_m (k_d (L_m.N) i_m,d + k_s (R_m.V)^s i_m,s)    Phong
//   I = k_a i_a + sum_m (k_d (L_m.N) i_m,d + k_s (N.H_m)^s' i_m,s)   Blinn-Phong
//
// with R the mirrored light and H half-way between light and viewer; each term only where its dot
// product is positive, and the specular one only where the diffuse one is. The specular term has no
// cosine, so that as a reflectance it is not reciprocal and not bounded at the light's horizon: the
// models to fit are those of model.h.
#pragma once

#include <optional>

#include "reflectance/reflectance.h"

namespace lobefit {

// k_d, k_s and the exponent of the specular term (>= 0), by channel; half_vector tells Blinn-Phong
// from Phong.
struct ClassicMaterial {
  Rgb diffuse = Rgb::Zero();
  Rgb specular = Rgb::Zero();
  Rgb exponent = Rgb::Constant(1);
  bool half_vector = false;
};

// What a light of i_d = i_s = 1 adds, for unit vectors in the local frame (N = +z).
Rgb evaluate_classic(const ClassicMaterial& material, const Vector3& light, const Vector3& viewer);

// The same as f cos(theta_i): a light of irradiance 1 has i_d = i_s = 1/pi, with which k_d is the
// albedo of the diffuse term.
Reflectance classic_reflectance(const ClassicMaterial& material);

// What both specular terms show, compared.
struct ExponentMatch {
  double exponent;       // s', of Blinn-Phong
  double error;          // the integral of |(N.H)^s' - (R.V)^s| over that of (R.V)^s
  double error_of_four;  // the same for the usual choice s' = 4 s
};

// The exponent by which Blinn-Phong's specular term comes nearest in L1 to that of Phong's exponent
// s (0.1 to 1e8), within 0.2 %: over all lights of the hemisphere alike for a viewer at
// `view_angle` (0 to pi/2) from the normal, or, without one, over all pixels of spheres lit from
// all directions.
//
// Near a sharp highlight, at a half vector h from the normal and a turn phi against the plane of
// incidence, R.V is 1 - 2 h^2 (cos^2 theta + sin^2 theta cos^2 phi) and N.H is 1 - h^2 / 2. Both
// powers are Gaussians then, whose rays differ by |1/s - 1/s'| up to such factors, so that the best
// s' is that of the median ray: s'/s tends to 2 (1 + cos^2 theta), and over spheres to 3.5175.
ExponentMatch match_exponent(double exponent, std::optional<double> view_angle = {});

}  // namespace lobefit
