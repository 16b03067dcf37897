#include "reflectance/albedo.h"

#include <algorithm>
#include <cmath>

#include "measurement/parallel.h"

namespace lobefit {
namespace {

// The cosine of a step of the table. Steps are dense toward grazing angles, where the albedo of
// polished surfaces rises steeply; the horizon itself, from where nothing is seen, is left out.
double cosine_of(int step, int steps) {
  const double root = std::max(step, 1) / static_cast<double>(steps);
  return root * root;
}

}  // namespace

Rgb directional_albedo(const Reflectance& reflectance, double view_angle) {
  constexpr int rings = 180, sectors = 30;
  // The plane of incidence is a plane of symmetry: half a turn is enough.
  using Sectors = Eigen::Array<double, sectors, 1>;
  const Sectors azimuth = Sectors::LinSpaced(0.5, sectors - 0.5) * (pi / sectors);
  const Sectors cos_phi = azimuth.cos(), sin_phi = azimuth.sin();
  const Vector3 wo(std::sin(view_angle), 0, std::cos(view_angle));
  Rgb albedo = Rgb::Zero();
  for (int ring = 0; ring < rings; ++ring) {
    // theta_h = t^2 90 deg, so that dtheta_h = 2 t 90 deg dt.
    const double t = (ring + 0.5) / rings;
    const double theta_h = t * t * pi / 2, width = t * pi / rings;
    const double sin_h = std::sin(theta_h), cos_h = std::cos(theta_h);
    for (int sector = 0; sector < sectors; ++sector) {
      const Vector3 half(sin_h * cos_phi[sector], sin_h * sin_phi[sector], cos_h);
      const double incidence = wo.dot(half);
      const Vector3 wi = 2 * incidence * half - wo;
      if (!(incidence > 0 && wi.z() > 0)) continue;
      const Rgb value = reflectance(wi, wo);
      if (value.isNaN().any()) continue;
      const double solid_angle = 4 * incidence * sin_h * width * 2 * pi / sectors;
      albedo += value * wi.z() * solid_angle;
    }
  }
  return albedo;
}

AlbedoByCosine::AlbedoByCosine(const Reflectance& f_times_cosine) {
  const Reflectance f = [&](const Vector3& wi, const Vector3& wo) -> Rgb {
    return f_times_cosine(wi, wo) / wi.z();
  };
  parallel_for(steps + 1, thread_count(0), [&](int step) {
    const double angle = std::acos(cosine_of(step, steps));
    albedo_[static_cast<std::size_t>(step)] = directional_albedo(f, angle);
  });
}

Rgb AlbedoByCosine::operator()(double view_cosine) const {
  const double place = std::sqrt(std::clamp(view_cosine, 0.0, 1.0)) * steps;
  const auto step = std::min(static_cast<std::size_t>(place), std::size_t{steps - 1});
  const double share = place - static_cast<double>(step);
  return (1 - share) * albedo_[step] + share * albedo_[step + 1];
}

}  // namespace lobefit
