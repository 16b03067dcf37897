// How much light is reflected toward a viewer.
#pragma once

#include "reflectance/reflectance.h"

namespace lobefit {

// The directional albedo toward a viewer at `view_angle` radians from the normal: the integral of
// f cos(theta_i) over the hemisphere of lights, by the midpoint rule over half vectors on the
// theta_h spacing of MERL tables (dense at the mirror direction), d wi = 4 (wo.wh) d wh.
// Directions in which f is unknown (NaN) add nothing.
Rgb directional_albedo(const Reflectance& reflectance, double view_angle);

}  // namespace lobefit
