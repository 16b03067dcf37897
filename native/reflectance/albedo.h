// How much light is reflected toward a viewer.
#pragma once

#include <array>

#include "reflectance/reflectance.h"

namespace lobefit {

// The directional albedo toward a viewer at `view_angle` radians from the normal: the integral of
// f cos(theta_i) over the hemisphere of lights, by the midpoint rule over half vectors on the
// theta_h spacing of MERL tables (dense at the mirror direction), d wi = 4 (wo.wh) d wh.
// Directions in which f is unknown (NaN) add nothing.
Rgb directional_albedo(const Reflectance& reflectance, double view_angle);

// The directional albedo of f cos(theta_i) toward viewers at any angle, from a table.
class AlbedoByCosine {
 public:
  // The reflectance is called from several threads.
  explicit AlbedoByCosine(const Reflectance& f_times_cosine);

  Rgb operator()(double view_cosine) const;

 private:
  static constexpr int steps = 48;

  std::array<Rgb, steps + 1> albedo_;
};

}  // namespace lobefit
