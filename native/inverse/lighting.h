// What lit a surface, and the pictures that were taken of it.
#pragma once

#include <vector>

#include "inverse/grid.h"
#include "measurement/vector3.h"

namespace lobefit {

// A light so far away that it comes from one direction. Directions are in the camera's frame: x to
// the right of the picture, y up, z toward the camera, which is so far away too (orthographic) that
// it sees every point from +z.
struct DirectionalLight {
  Vector3 direction;  // unit, toward the light
  Rgb irradiance;     // on a surface that faces it
};

// All that lights one picture. Of the ambient radiance, the same from everywhere, a point reflects
// its directional albedo. The value of a pixel is exposure times radiance.
struct Lighting {
  std::vector<DirectionalLight> lights;
  Rgb ambient = Rgb::Zero();
  double exposure = 1;
};

// Pictures of the same points under different lighting.
struct Pictures {
  Grid grid;
  std::vector<Lighting> lighting;  // of each picture
  // Of each picture three linear floats a pixel, row by row from the top.
  std::vector<std::vector<float>> values;
  // A value from here on only tells that the pixel was at least that bright.
  float saturation = 1e30f;
};

}  // namespace lobefit
