// What a pixel shows under a lighting, by its normal.
#pragma once

#include <optional>

#include "inverse/lighting.h"
#include "reflectance/albedo.h"
#include "reflectance/seen_point.h"

namespace lobefit {

// The forward direction: lights and ambient light on one point, without shadows that others cast.
class Shading {
 public:
  // f cos(theta_i), called from several threads. The ambient light of these lightings alone is
  // known.
  Shading(const Reflectance& f_times_cosine, const std::vector<Lighting>& lighting);

  // The value of a pixel, exposure included.
  Rgb value(const SeenPoint& point, const Lighting& lighting) const;

 private:
  const Reflectance& f_times_cosine_;
  std::optional<AlbedoByCosine> albedo_;  // where there is ambient light
};

}  // namespace lobefit
