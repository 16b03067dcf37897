// The few small types that every room shares.
#pragma once

#include <Eigen/Core>

namespace lobefit {

using Vector3 = Eigen::Vector3d;
// Red, green and blue, linear Rec.709; arithmetic is by component.
using Rgb = Eigen::Array3d;

inline constexpr double pi = 3.14159265358979323846;

inline constexpr double radians(double degrees) { return degrees * (pi / 180); }
inline constexpr double degrees(double radians) { return radians * (180 / pi); }

}  // namespace lobefit
