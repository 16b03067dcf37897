#include "inverse/shading.h"

#include <algorithm>

namespace lobefit {

Shading::Shading(const Reflectance& f_times_cosine, const std::vector<Lighting>& lighting)
    : f_times_cosine_(f_times_cosine) {
  const bool ambient = std::any_of(lighting.begin(), lighting.end(),
                                   [](const Lighting& each) { return (each.ambient > 0).any(); });
  if (ambient) albedo_.emplace(f_times_cosine);
}

Rgb Shading::value(const SeenPoint& point, const Lighting& lighting) const {
  Rgb radiance = Rgb::Zero();
  if (albedo_) radiance = lighting.ambient * (*albedo_)(point.view_cosine());
  for (const DirectionalLight& light : lighting.lights) {
    radiance += point.lit(f_times_cosine_, light.direction) * light.irradiance;
  }
  return lighting.exposure * radiance;
}

}  // namespace lobefit
