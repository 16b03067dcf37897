// Normals in the stereographic plane, in which Ikeuchi and Horn, "Numerical shape from shading and
// occluding boundaries", Artificial Intelligence 17, 1981, write them: slopes grow beyond all
// bounds toward the silhouette, where this plane has the unit circle, and its angles are those
// between normals.
#pragma once

#include <Eigen/Core>

#include "measurement/vector3.h"

namespace lobefit {

using Place = Eigen::Vector2d;
using NormalSlopes = Eigen::Matrix<double, 3, 2>;

// Just inside the silhouette: nothing is seen of what lies beyond.
inline constexpr double rim = 0.998;

// The place itself, or the nearest one that faces the viewer.
inline Place facing(const Place& place) {
  const double radius = place.norm();
  return radius > rim ? Place(place * (rim / radius)) : place;
}

// n = (2u, 2v, 1 - u^2 - v^2) / (1 + u^2 + v^2).
inline Vector3 normal_at(const Place& place) {
  const double r2 = place.squaredNorm();
  return Vector3(2 * place.x(), 2 * place.y(), 1 - r2) / (1 + r2);
}

// Its derivatives by u and v.
inline NormalSlopes normal_slopes(const Place& place) {
  const double scale = 2 / (1 + place.squaredNorm());
  const Vector3 n = normal_at(place);
  NormalSlopes slopes;
  slopes << scale, 0, 0, scale, 0, 0;
  slopes.col(0) -= scale * place.x() * (n + Vector3::UnitZ());
  slopes.col(1) -= scale * place.y() * (n + Vector3::UnitZ());
  return slopes;
}

// The place of a unit normal that does not point away from the viewer altogether.
inline Place place_of(const Vector3& n) { return Place(n.x(), n.y()) / (1 + n.z()); }

}  // namespace lobefit
