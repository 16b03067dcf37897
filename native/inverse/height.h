// Heights of a surface seen from above, in pixels.
#pragma once

#include <vector>

#include "inverse/grid.h"
#include "measurement/vector3.h"

namespace lobefit {

// The heights whose slopes come nearest to those of the normals (unit, z > 0), by weighted least
// squares over the mask: Poisson's equation with the natural boundary condition (Horn and Brooks
// 1986; Queau, Durou and Aujol, "Normal integration: a survey", JMIV 2018). Slopes count by the
// square of n.z, as their own errors grow toward the silhouette. A surface is taken for continuous
// within each part of the mask, and each part stands with its lowest point at 0.
std::vector<double> integrate_normals(const Grid& grid, const std::vector<Vector3>& normals);

// The normals of the mask blown up like a balloon: n ~ (-grad w / 2, sqrt w), where w, the square
// of the height, solves Laplace w = -4 and is 0 along the silhouette. Of a disc that is the
// hemisphere. Where the picture's edge cuts the surface it is taken to go on as it is.
std::vector<Vector3> inflated_normals(const Grid& grid);

}  // namespace lobefit
