// Blender's Principled BSDF as Cycles 4.2 to 5.2 evaluate it, and the best one for any reflectance.
#pragma once

#include "closures/target.h"
#include "measurement/vector3.h"

namespace lobefit {

// The sockets of a Principled BSDF with the distribution "GGX" and every other socket at its
// default: colours and metallic in [0, 1], roughness in [0, 1], ior >= 1. error is the distance to
// the target it was fitted to, by error_of.
struct Principled {
  Rgb base_color = Rgb::Zero();
  double metallic = 0;
  double roughness = 0.5;
  double ior = 1;
  Rgb specular_tint = Rgb::Ones();
  double error = 0;
};

// f cos(theta_i) in 1/sr for unit vectors toward the light (wi) and the viewer (wo) in the local
// frame whose normal is +z; 0 below the horizon. With m the metallic, C the base colour, T the
// specular tint and F0 the dielectric's reflectance at normal incidence,
//
//   f cos = (m F_metal + (1 - m) F_dielectric) D G / (4 n.wo) + (1 - m) (1 - A) C n.wi / pi,
//
// D and G the GGX distribution and height-correlated masking for alpha = roughness^2 (Walter et al.
// 2007; Heitz 2014, eq. 99), F_metal Schlick's F0 = C with the edge tint of Kutz, Hasan and
// Edmondson (2021), F_dielectric Fresnel's reflectance with F0 replaced by T F0, and A the estimate
// of the coat's albedo toward the viewer. A depends on wo alone, so the diffuse part is not
// reciprocal. A mirror (roughness below 0.0038, in 4.2 below 0.0266) shows no light of size 0.
Rgb evaluate_principled(const Principled& principled, const Vector3& wi, const Vector3& wo);

// The Principled BSDF that is nearest to the target by error_of, the best of 32 starts. Always
// gives legal, finite sockets; a target without samples gives a black one without a coat, with the
// error 0. roughness is at least 0.03, ior at most 99. Takes some 0.03 s on one thread. threads: 0
// for every processor; the result is the same for any number.
Principled fit_principled(const Target& target, int threads = 0);

}  // namespace lobefit
