// What the pixels of some pictures show, at one size.
#pragma once

#include <vector>

#include "inverse/grid.h"
#include "inverse/lighting.h"
#include "inverse/observed.h"
#include "inverse/reflectance_map.h"

namespace lobefit {

// A grid with what its pixels show in all pictures, compressed as in the reflectance map.
struct Level {
  Grid grid;
  std::vector<float> values;  // channels of the map for each pixel
  int channels = 0;
  float saturated = 0;
  float noise = 0;  // the standard deviation of a value, in floors of the map

  const float* values_at(std::size_t pixel) const {
    return values.data() + pixel * static_cast<std::size_t>(channels);
  }
  Observed at(std::size_t pixel) const { return {values_at(pixel), channels, saturated, noise}; }

  // The same with pixels twice as wide, each the mean light of what it holds of the surface.
  Level halved() const;
};

// What some pictures show, of which a value has noise of this standard deviation.
Level level_of(const Pictures& pictures, const ReflectanceMap& map, double noise);

}  // namespace lobefit
