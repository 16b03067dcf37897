// A point of a surface in front of a camera.
#pragma once

#include <Eigen/Geometry>

#include "reflectance/reflectance.h"

namespace lobefit {

// A point with this unit normal, seen from +z.
class SeenPoint {
 public:
  explicit SeenPoint(const Vector3& normal) {
    const Vector3 tangent = normal.unitOrthogonal();
    to_local_ << tangent.transpose(), normal.cross(tangent).transpose(), normal.transpose();
    viewer_ = to_local_ * Vector3::UnitZ();
  }

  double view_cosine() const { return viewer_.z(); }

  // The radiance toward the viewer under a light of irradiance 1 from this direction; black where
  // the reflectance is not known.
  Rgb lit(const Reflectance& f_times_cosine, const Vector3& light) const {
    const Vector3 wi = to_local_ * light;
    if (!(wi.z() > 0)) return Rgb::Zero();
    const Rgb radiance = f_times_cosine(wi, viewer_);
    return radiance.isNaN().any() ? Rgb(Rgb::Zero()) : radiance;
  }

 private:
  Eigen::Matrix3d to_local_;
  Vector3 viewer_;
};

}  // namespace lobefit
