// The inverse of shading: normals and heights of a surface whose reflectance is known.
#pragma once

#include <vector>

#include "fitting/monitor.h"
#include "inverse/lighting.h"
#include "reflectance/reflectance.h"

namespace lobefit {

struct NormalsOptions {
  double floor = 1e-3;  // the value of a pixel under which noise rules, > 0
  double noise = 0;     // its standard deviation
  int threads = 0;      // 0: every processor
};

// Of every pixel, row by row from the top; 0 where nothing of the surface is shown.
struct Normals {
  Grid grid;
  std::vector<Vector3> normals;  // unit, in the camera's frame, z > 0
  std::vector<double> heights;   // in pixels, the lowest point of each part at 0
};

// The normals that explain the pictures best, and the surface that has them. From three pictures on
// a pixel's neighbours decide only where noise hides what it shows; from fewer all pixels are
// estimated together, by way of the silhouette. The reflectance is f cos(theta_i) and is called
// from several threads. The same for any number of threads.
Normals estimate_normals(const Pictures& pictures, const Reflectance& f_times_cosine,
                         const NormalsOptions& options, Monitor& monitor);

}  // namespace lobefit
