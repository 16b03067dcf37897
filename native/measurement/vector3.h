// The few small types that every room shares.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <utility>

namespace lobefit {

using Vector3 = Eigen::Vector3d;
// Red, green and blue, linear Rec.709; arithmetic is by component.
using Rgb = Eigen::Array3d;

inline constexpr double pi = 3.14159265358979323846;

inline constexpr double square(double x) { return x * x; }

inline constexpr double radians(double degrees) { return degrees * (pi / 180); }
inline constexpr double degrees(double radians) { return radians * (180 / pi); }

// Unit vectors toward the light (wi) and the viewer (wo), turned together about the normal +z so
// that the viewer is in the xz plane, x >= 0.
inline std::pair<Vector3, Vector3> turned_to_viewer(const Vector3& wi, const Vector3& wo) {
  const double sine = std::hypot(wo.x(), wo.y());
  const double c = sine > 0 ? wo.x() / sine : 1, s = sine > 0 ? wo.y() / sine : 0;
  return {{c * wi.x() + s * wi.y(), c * wi.y() - s * wi.x(), wi.z()}, {sine, 0, wo.z()}};
}

}  // namespace lobefit
