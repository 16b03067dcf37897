#include "closures/world_excess.h"

#include <array>
#include <cmath>

// Before the formulas, which find there what lanes can do.
#include "measurement/lanes.inc"
//
#include "closures/closure_kernel.h"
#include "closures/microfacet_terms.inc"

namespace lobefit {
namespace {

constexpr std::size_t most_closures = most_specular_closures + 1;
using PerClosure = std::array<double, most_closures>;

// Directions of light beside each other, with the half vectors of these and the viewer.
struct Lights {
  Direction<Lanes> wi, half;
  Lanes solid_angle;
};

// What lies between the horizons of a closure and of the surface: a wedge of one slope along each
// azimuth from the plane of incidence. Both steps crowd toward where a narrow closure reflects
// most. A thirtieth of the nodes that live_lobe.cpp takes for a thousandth of all light.
constexpr int azimuths = 8, slopes = 8;

struct Azimuth {
  double cosine, sine, width;
};

std::array<Azimuth, azimuths> spread_azimuths() {
  std::array<Azimuth, azimuths> all;
  for (int i = 0; i < azimuths; ++i) {
    const double u = (i + 0.5) / azimuths, azimuth = pi / 2 * square(u);
    // On both sides of the plane.
    all[static_cast<std::size_t>(i)] = {std::cos(azimuth), std::sin(azimuth),
                                        2 * pi * u / azimuths};
  }
  return all;
}

template <typename Visit>
void for_each_beyond(double tilt, const Vector3& wo, Visit&& visit) {
  static const std::array<Azimuth, azimuths> around = spread_azimuths();
  static_assert(slopes % 4 == 0, "lanes are full");
  for (const Azimuth& at : around) {
    const double along = -std::copysign(at.cosine, tilt), greatest = -tilt * along;
    for (int j = 0; j < slopes; j += 4) {
      const Lanes v = (Lanes{0.5, 1.5, 2.5, 3.5} + j) / slopes, slope = greatest * (1 - v * v);
      const Lanes flat = 1 / square_root(1 + slope * slope);
      const Direction<Lanes> wi{flat * along, flat * at.sine, flat * slope};
      const Lanes x = wi.x + wo.x(), y = wi.y, z = wi.z + wo.z();
      const Lanes shrink = 1 / square_root(x * x + y * y + z * z);
      visit(Lights{wi,
                   {x * shrink, y * shrink, z * shrink},
                   at.width * greatest * 2 / slopes * v * flat * flat * flat});
    }
  }
}

// f cos, and the density by solid angle of the directions that Cycles draws for it, by the normals
// that the viewer sees (Heitz 2018): D G1(wo) / (4 n'.wo).
struct Drawn {
  Lanes value, density;
};

template <bool beyond>
Drawn drawn(const MicrofacetTerms& m, const Lights& to) {
  const Lanes value = closure_value<false, Lanes, beyond>(m, to.wi, to.half).value;
  const Lanes height = absolute(to.wi.z + m.tilt * to.wi.x);
  const Lanes masked =
      masked_height<false, double>(m.distribution, elevation(m, to.wi, height)).value;
  const Lanes density = value * (masked / height + m.masking_o.value) / (m.masking_o.value + 0.5);
  return {value, choose(value > 0.0, density, Lanes{})};
}

// All closures beyond the horizon of one of them, the diffuse one last.
std::array<Drawn, most_closures> all_drawn(std::span<const Microfacet> closures, std::size_t bent,
                                           const Lights& to) {
  std::array<Drawn, most_closures> all;
  for (std::size_t j = 0; j < closures.size(); ++j) {
    const MicrofacetTerms& m = closures[j].terms();
    all[j] = j == bent ? drawn<true>(m, to) : drawn<false>(m, to);
  }
  const Lanes diffuse = to.wi.z / pi;
  all[closures.size()] = {diffuse, diffuse};
  return all;
}

// Sums over the lights beyond all horizons. A weight counts by its own channel's light and by the
// mean of its channels, with which its closure is drawn.
struct Sums {
  Lanes albedo[3]{}, by_mean[3][most_closures]{}, by_own_weight[most_closures]{};

  template <bool derivatives>
  void add(const Lights& to, const std::array<Drawn, most_closures>& at, std::size_t bent,
           const Eigen::Ref<const Eigen::Matrix3Xd>& weights, const PerClosure& means) {
    const auto closures = static_cast<std::size_t>(weights.cols());
    Lanes density{};
    for (std::size_t j = 0; j < closures; ++j) density += means[j] * at[j].density;
    const Lanes inverse = 1 / choose(density > 0.0, density, splat(1));
    const Lanes share = means[bent] * at[bent].density * inverse;
    for (int c = 0; c < 3; ++c) {
      Lanes light{};
      for (std::size_t j = 0; j < closures; ++j) light += weights(c, j) * at[j].value;
      light *= to.solid_angle;
      albedo[c] += share * light;
      for (std::size_t j = 0; derivatives && j < closures; ++j) {
        by_mean[c][j] += light * ((j == bent ? 1.0 : 0.0) - share) * at[j].density * inverse;
      }
    }
    for (std::size_t j = 0; derivatives && j < closures; ++j) {
      by_own_weight[j] += to.solid_angle * share * at[j].value;
    }
  }
};

}  // namespace

template <bool derivatives>
WorldExcess world_excess(std::span<const Microfacet> closures,
                         const Eigen::Ref<const Eigen::Matrix3Xd>& weights) {
  PerClosure means{};
  for (std::size_t j = 0; j <= closures.size(); ++j) means[j] = weights.col(j).mean();
  Sums sums;
  for (std::size_t k = 0; k < closures.size(); ++k) {
    for_each_beyond(closures[k].terms().tilt, closures[k].wo(), [&](const Lights& to) {
      sums.add<derivatives>(to, all_drawn(closures, k, to), k, weights, means);
    });
  }
  WorldExcess excess;
  if (derivatives) excess.by_weights.resize(3, 3 * weights.cols());
  for (int c = 0; c < 3; ++c) {
    excess.albedo[c] = sum(sums.albedo[c]);
    for (Eigen::Index j = 0; derivatives && j < weights.cols(); ++j) {
      excess.by_weights.row(c).segment<3>(3 * j).setConstant(sum(sums.by_mean[c][j]) / 3);
      excess.by_weights(c, 3 * j + c) += sum(sums.by_own_weight[j]);
    }
  }
  return excess;
}

template WorldExcess world_excess<false>(std::span<const Microfacet>,
                                         const Eigen::Ref<const Eigen::Matrix3Xd>&);
template WorldExcess world_excess<true>(std::span<const Microfacet>,
                                        const Eigen::Ref<const Eigen::Matrix3Xd>&);

}  // namespace lobefit
