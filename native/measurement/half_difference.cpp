#include "measurement/half_difference.h"

#include <Eigen/Geometry>
#include <cmath>

namespace lobefit {

HalfDifference to_half_difference(const Vector3& wi, const Vector3& wo) {
  const Vector3 half = (wi + wo).normalized();
  const double sin_h = half.head<2>().norm();
  // At theta_h = 0 the azimuth of the half vector is free; x is taken.
  const double cos_phi_h = sin_h > 0 ? half.x() / sin_h : 1.0;
  const double sin_phi_h = sin_h > 0 ? half.y() / sin_h : 0.0;
  const double turned_x = cos_phi_h * wi.x() + sin_phi_h * wi.y();
  const double turned_y = cos_phi_h * wi.y() - sin_phi_h * wi.x();
  const double difference_x = half.z() * turned_x - sin_h * wi.z();
  double phi_d = std::atan2(turned_y, difference_x);
  if (phi_d < 0) phi_d += pi;
  if (phi_d >= pi) phi_d -= pi;
  // atan2 of sine and cosine keeps its accuracy near 0, where acos of the cosine loses half.
  return {std::atan2(sin_h, half.z()), std::atan2(wi.cross(half).norm(), wi.dot(half)), phi_d};
}

Directions to_directions(const HalfDifference& point) {
  const double sin_h = std::sin(point.theta_h), cos_h = std::cos(point.theta_h);
  const double sin_d = std::sin(point.theta_d), cos_d = std::cos(point.theta_d);
  const Vector3 half(sin_h, 0, cos_h);
  const double along = sin_d * std::cos(point.phi_d), across = sin_d * std::sin(point.phi_d);
  const Vector3 offset(along * cos_h, across, -along * sin_h);
  return {cos_d * half + offset, cos_d * half - offset};
}

}  // namespace lobefit
