// Half and difference angles (Rusinkiewicz 1998), the coordinates of isotropic MERL tables.
#pragma once

#include "measurement/vector3.h"

namespace lobefit {

// Radians. theta_h in [0, pi/2] is the angle between the half vector and the normal, theta_d in
// [0, pi/2] the angle between the light and the half vector, phi_d in [0, pi) the azimuth of the
// light about the half vector; reciprocity makes phi_d and phi_d + pi the same point.
struct HalfDifference {
  double theta_h;
  double theta_d;
  double phi_d;
};

// Unit vectors toward the light and the viewer in the local frame whose normal is +z.
struct Directions {
  Vector3 wi;
  Vector3 wo;
};

HalfDifference to_half_difference(const Vector3& wi, const Vector3& wo);

// The directions whose half vector lies in the xz plane; the inverse up to a turn about the normal.
Directions to_directions(const HalfDifference& point);

}  // namespace lobefit
