// A quick look at a reflectance: a sphere under two lights.
#pragma once

#include <vector>

#include "reflectance/reflectance.h"

namespace lobefit {

// The picture of an orthographic sphere that fills a square of size x size pixels: three linear
// floats a pixel (radiance), row by row from the top; 0 off the sphere. A light for which the
// reflectance is NaN adds nothing. The reflectance given is f cos(theta_i), cosine included, and is
// called from several threads. The camera looks from +z, x to the right and y up. Two lights of
// irradiance 1 come from the directions (1, 1, 1.2), the upper right, and (-1, -1, -0.55), behind
// the lower left, which grazes the rim. Around it all is a world of the radiance `world` (>= 0),
// the same from everywhere, of which a point reflects its directional albedo; light that other
// points reflect is left out.
std::vector<float> render_two_lights(const Reflectance& f_times_cosine, int size, double world = 0);

}  // namespace lobefit
