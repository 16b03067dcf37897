// What the pixels of some pictures show, at one size.
#pragma once

#include <vector>

#include "inverse/grid.h"
#include "inverse/lighting.h"
#include "inverse/reflectance_map.h"

namespace lobefit {

// A grid with what its pixels show in all pictures, compressed as in the reflectance map.
struct Level {
  Grid grid;
  std::vector<float> observed;  // channels of the map for each pixel
  int channels = 0;
  float saturated = 0;

  const float* at(std::size_t pixel) const {
    return observed.data() + pixel * static_cast<std::size_t>(channels);
  }

  // The same with pixels twice as wide, each the mean light of what it holds of the surface.
  Level halved() const;
};

// What some pictures show; their values are compressed by the map.
Level level_of(const Pictures& pictures, const ReflectanceMap& map);

}  // namespace lobefit
