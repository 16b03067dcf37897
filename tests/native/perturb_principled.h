// Whether a Principled BSDF is at a minimum of its error.
#pragma once

#include <algorithm>
#include <cmath>
#include <random>

#include "closures/principled.h"

namespace lobefit {

// The largest part of the error that one of `count` random perturbations takes away, or 0. Every
// other one moves a single socket, the others move all, by up to 0.001 to 0.3 of a socket's range;
// the index of refraction counts as (ior - 1) / (ior + 1), which has a range of 1.
inline double gain_of_perturbations(const Target& target, const Principled& fit, int count) {
  constexpr int sockets = 9;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  double least = fit.error;
  for (int i = 0; i < count; ++i) {
    const double size = 0.001 * std::pow(300, uniform(random));
    const int only = static_cast<int>(sockets * uniform(random));
    auto moved = [&, socket = 0](double value) mutable {
      const double offset = size * (2 * uniform(random) - 1);
      return std::clamp(value + (i % 2 == 0 || socket++ == only ? offset : 0), 0.0, 1.0);
    };
    Principled other = fit;
    for (int c = 0; c < 3; ++c) other.base_color[c] = moved(fit.base_color[c]);
    for (int c = 0; c < 3; ++c) other.specular_tint[c] = moved(fit.specular_tint[c]);
    other.metallic = moved(fit.metallic);
    other.roughness = std::max(moved(fit.roughness), 0.03);
    const double root = std::min(moved((fit.ior - 1) / (fit.ior + 1)), 0.98);
    other.ior = (1 + root) / (1 - root);
    least = std::min(least, error_of(target, [&](const Vector3& wi, const Vector3& wo) {
                       return evaluate_principled(other, wi, wo);
                     }));
  }
  return fit.error > 0 ? 1 - least / fit.error : 0;
}

}  // namespace lobefit
