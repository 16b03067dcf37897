// Normals of all pixels together from one picture or two: shape from shading.
#pragma once

#include <vector>

#include "fitting/monitor.h"
#include "inverse/level.h"

namespace lobefit {

// A value that a pixel has under one light belongs to a whole curve of normals, on a line through a
// cylinder to two of them. Which one it is, is told by what lies around it: the normals' x and y
// are smooth (on a sphere they are harmonic, so that this asks for no flatness), and along the
// silhouette, where the surface turns away from the viewer, they are those of the mask blown up
// (inflated_normals), which is also where the search starts. Found as Ikeuchi and Horn did in 1981,
// by relaxation over the stereographic plane, from coarse pixels to fine ones; each pixel's step is
// one of Ceres' TinySolver. Pixels of one colour of four are moved together, so that the result is
// the same for any number of threads.
std::vector<Place> estimate_jointly(const ReflectanceMap& map, const Level& level, int threads,
                                    Monitor& monitor);

}  // namespace lobefit
