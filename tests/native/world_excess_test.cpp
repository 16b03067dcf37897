#include "closures/world_excess.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace lobefit {
namespace {

struct Closure {
  Distribution distribution;
  double alpha_x, alpha_y, tilt;

  Microfacet seen_from(const Vector3& wo) const {
    return {distribution, {std::log(alpha_x), std::log(alpha_y), tilt}, wo};
  }
  Vector3 normal() const { return Vector3(tilt, 0, 1).normalized(); }
  // Smith's tan^2 theta of a direction, each axis times its alpha.
  double slope2(const Vector3& w) const {
    const Vector3 n = normal(), along(n.z(), 0, -n.x());
    return (square(alpha_x * w.dot(along)) + square(alpha_y * w.y())) / square(w.dot(n));
  }
  double lambda(const Vector3& w) const {
    const double t2 = slope2(w);
    if (distribution == Distribution::ggx) return (std::sqrt(1 + t2) - 1) / 2;
    const double a = 1 / std::sqrt(t2);
    return a < 1.6 ? (1 - 1.259 * a + 0.396 * a * a) / (3.535 * a + 2.181 * a * a) : 0;
  }
  // D / (4 n'.wo).
  double unmasked(const Vector3& half, const Vector3& wo) const {
    const double c = half.dot(normal());
    if (!(c > 0)) return 0;
    const Closure inverse{distribution, 1 / alpha_x, 1 / alpha_y, tilt};
    const double slope2 = inverse.slope2(half);
    const double part =
        distribution == Distribution::ggx ? 1 / square(1 + slope2) : std::exp(-slope2);
    return part / (pi * alpha_x * alpha_y * std::pow(c, 4)) / (4 * normal().dot(wo));
  }
};

// What samples beyond any closure's horizon show, by a sum over all the hemisphere as Cycles draws
// there: first which closure, then where, and all that may have drawn it are asked.
Rgb plain_sum(const std::vector<Closure>& closures, const Eigen::Matrix3Xd& weights,
              const Vector3& wo) {
  constexpr int heights = 500, azimuths = 500;
  const std::size_t count = closures.size();
  const Eigen::VectorXd means = weights.colwise().mean();
  Rgb sum = Rgb::Zero();
  for (int i = 0; i < heights; ++i) {
    const double u = (i + 0.5) / heights, z = square(u), flat = std::sqrt(1 - z * z);
    for (int j = 0; j < azimuths; ++j) {
      const double phi = (j + 0.5) * pi / azimuths;
      const Vector3 wi(flat * std::cos(phi), flat * std::sin(phi), z);
      const Vector3 half = (wi + wo).normalized();
      for (std::size_t k = 0; k < count; ++k) {
        if (wi.dot(closures[k].normal()) > 0) continue;
        Rgb light = weights.col(static_cast<Eigen::Index>(count)).array() * z / pi;
        double density = means[static_cast<Eigen::Index>(count)] * z / pi, own = 0;
        for (std::size_t l = 0; l < count; ++l) {
          const Closure& closure = closures[l];
          if (l != k && wi.dot(closure.normal()) <= 0) continue;
          const double unmasked = closure.unmasked(half, wo), viewer = closure.lambda(wo);
          const auto column = static_cast<Eigen::Index>(l);
          light += weights.col(column).array() * unmasked / (1 + closure.lambda(wi) + viewer);
          const double drawn = means[column] * unmasked / (1 + viewer);
          density += drawn;
          if (l == k) own = drawn;
        }
        if (own > 0) sum += 2 * u / heights * 2 * pi / azimuths * own / density * light;
      }
    }
  }
  return sum;
}

// Closures as materials have them, bent to either side, of two channels that differ.
struct Mixed {
  std::vector<Closure> closures;
  Eigen::Matrix3Xd weights;
  Vector3 wo;

  explicit Mixed(std::mt19937& random) {
    std::uniform_real_distribution<double> part(0, 1);
    const double angle = 0.2 + 1.1 * part(random);
    wo = Vector3(std::sin(angle), 0, std::cos(angle));
    const int count = 1 + static_cast<int>(3 * part(random));
    for (int k = 0; k < count; ++k) {
      const double alpha = 0.15 + 0.7 * part(random);
      const auto distribution = part(random) < 0.5 ? Distribution::ggx : Distribution::beckmann;
      // The viewer stays above the closure's horizon, as Cycles sees to.
      const double tilt = part(random) < 0.6 ? 0.6 * part(random)
                                             : -0.5 * part(random) * std::min(1.0, wo.z() / wo.x());
      closures.push_back({distribution, alpha, alpha * (0.7 + 0.5 * part(random)), tilt});
    }
    weights.resize(3, count + 1);
    for (double& weight : weights.reshaped()) weight = 0.05 + part(random);
    weights.row(2) = weights.row(1);
  }

  std::vector<Microfacet> seen() const {
    std::vector<Microfacet> all;
    for (const Closure& closure : closures) all.push_back(closure.seen_from(wo));
    return all;
  }
};

TEST(ClosuresWorldExcess, IsThatOfAPlainSum) {
  std::mt19937 random(1);
  double most = 0;
  for (int i = 0; i < 40; ++i) {
    const Mixed mixed(random);
    const Rgb expected = plain_sum(mixed.closures, mixed.weights, mixed.wo);
    const Rgb found = world_excess<false>(mixed.seen(), mixed.weights).albedo;
    // Few nodes suffice: the limit on it is an eighth below what is wanted. What is 1e-5 of all
    // light need not be as near.
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[c], expected[c], 0.07 * expected[c] + 1e-5) << i;
    most = std::max(most, expected.maxCoeff());
  }
  EXPECT_GT(most, 0.05) << "nothing lies beyond";
}

TEST(ClosuresWorldExcess, IsNoneOfClosuresThatAreNotBent) {
  const Vector3 wo(0.6, 0, 0.8);
  const Closure flat{Distribution::ggx, 0.5, 0.5, 0};
  const std::vector<Microfacet> seen = {flat.seen_from(wo)};
  EXPECT_TRUE((world_excess<false>(seen, Eigen::Matrix3Xd::Ones(3, 2)).albedo == 0).all());
}

TEST(ClosuresWorldExcess, HasTheDerivativesOfDifferences) {
  std::mt19937 random(2);
  for (int i = 0; i < 10; ++i) {
    Mixed mixed(random);
    const std::vector<Microfacet> seen = mixed.seen();
    const WorldExcess excess = world_excess<true>(seen, mixed.weights);
    for (Eigen::Index w = 0; w < mixed.weights.size(); ++w) {
      constexpr double step = 1e-5;
      double& weight = mixed.weights.reshaped()[w];
      const auto moved = [&](double by) {
        weight += by;
        const Rgb albedo = world_excess<false>(seen, mixed.weights).albedo;
        weight -= by;
        return albedo;
      };
      const Rgb expected = (moved(step) - moved(-step)) / (2 * step);
      // What rounding leaves of differences so small.
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(excess.by_weights(c, w), expected[c], 1e-8) << i;
    }
  }
}

}  // namespace
}  // namespace lobefit
