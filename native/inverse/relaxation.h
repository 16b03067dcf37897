// Normals of all pixels together: what a pixel shows, and what its neighbours let expect.
#pragma once

#include <vector>

#include "fitting/monitor.h"
#include "inverse/level.h"

namespace lobefit {

// Both relax as Ikeuchi and Horn did in 1981, over the stereographic plane, from coarse pixels to
// fine ones; each pixel's step is one of Ceres' TinySolver. Normals' x and y are taken to be smooth
// (on a sphere they are harmonic, so that this asks for no flatness). Pixels of one colour of four
// are moved together, so that the result is the same for any number of threads.

// From one picture or two: shape from shading. A value that a pixel has under one light belongs to
// a whole curve of normals, on a line through a cylinder to two of them. Which one it is, is told
// by what lies around it, and along the silhouette, where the surface turns away from the viewer,
// by the normals of the mask blown up (inflated_normals), which is also where the search starts.
std::vector<Place> relaxed_from_silhouette(const ReflectanceMap& map, const Level& level,
                                           int threads, Monitor& monitor);

// From three pictures on, where each pixel tells its normal by itself, unless it is dark in all of
// them, as a mirror is beside its highlights, and noise hides what it tells. Smoothness weighs so
// little that it decides there alone. Each level starts from the coarser one, and of a pixel from
// what it tells by itself where that is better.
std::vector<Place> relaxed_from_pixels(const ReflectanceMap& map, const Level& level, int threads,
                                       Monitor& monitor);

}  // namespace lobefit
