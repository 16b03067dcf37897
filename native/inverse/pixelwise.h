// Normals of single pixels from three pictures or more: photometric stereo (Woodham 1980).
#pragma once

#include <vector>

#include "fitting/monitor.h"
#include "inverse/level.h"
#include "inverse/reflectance_map.h"

namespace lobefit {

// For each pixel of the level the place that explains it best, of all that face the viewer: the
// best places of a grid over the stereographic plane are refined by Ceres. Every pixel is estimated
// by itself, so that the result is the same for any number of threads. Progress runs between two
// values.
std::vector<Place> estimate_pixelwise(const ReflectanceMap& map, const Level& level, int threads,
                                      Monitor& monitor, double from, double to);

}  // namespace lobefit
