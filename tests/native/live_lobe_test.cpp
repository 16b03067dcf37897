#include "closures/live_lobe.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>
#include <vector>

#include "reflectance/albedo.h"
#include "reflectance/fresnel.h"

namespace lobefit {
namespace {

Vector3 at_angle(double theta, double phi = 0) {
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

Parameters interpolated(double exponent, double interpolation, std::optional<double> ior = {}) {
  Parameters parameters;
  parameters.specular = Rgb::Ones();
  parameters.exponent = Rgb::Constant(exponent);
  parameters.interpolation = interpolation;
  parameters.ior = ior;
  return parameters;
}

double formula(const Parameters& parameters, const Vector3& wi, const Vector3& wo) {
  return evaluate_model(parameters, wi, wo)[0] * std::max(wi.z(), 0.0);
}

// The mean of |live - formula| over that of the formula, over the hemisphere of lights, on polar
// rings about the mirror direction that are as dense as the lobe is narrow.
double relative_error(const Parameters& parameters, double view_angle) {
  constexpr int rings = 60, spokes = 60;
  const Vector3 wo = at_angle(view_angle), mirror = at_angle(-view_angle);
  const Vector3 side = Vector3::UnitY(), up = mirror.cross(side);
  const double power = parameters.exponent[0] / 3 + 1;
  double difference = 0, total = 0;
  for (int ring = 0; ring < rings; ++ring) {
    const auto cosine = [&](double share) { return 2 * std::pow(1 - share, 1 / power) - 1; };
    const double low = cosine((ring + 1.0) / rings), high = cosine(double(ring) / rings);
    const double c = (low + high) / 2, s = std::sqrt(1 - c * c);
    for (int spoke = 0; spoke < spokes; ++spoke) {
      const double phi = 2 * pi * (spoke + 0.5) / spokes;
      const Vector3 wi = c * mirror + s * (std::cos(phi) * up + std::sin(phi) * side);
      const double expected = formula(parameters, wi, wo);
      difference += std::abs(live_lobe(parameters, wi, wo)[0] - expected) * (high - low);
      total += expected * (high - low);
    }
  }
  return difference / total;
}

TEST(NormalAlbedo, IsTheIntegral) {
  for (const double exponent : {0.0, 0.4, 3.0, 40.0, 5000.0}) {
    for (const double alpha : {0.0, 0.3, 1.0}) {
      const Parameters lobe = interpolated(exponent, alpha);
      double sum = 0;
      constexpr int steps = 20000;
      for (int i = 0; i < steps; ++i) {
        // Rings of (1 - cos) = share^3 are dense where a narrow lobe is.
        const double share = (i + 0.5) / steps, cosine = 1 - share * share * share;
        const Vector3 wi = at_angle(std::acos(cosine));
        sum += formula(lobe, wi, Vector3::UnitZ()) * 2 * pi * 3 * share * share / steps;
      }
      // Exact for Phong's lobe; the rational function is within 0.15 % of the others.
      EXPECT_NEAR(normal_albedo(exponent, alpha) / sum, 1, alpha == 0 ? 1e-5 : 1.6e-3)
          << exponent << " " << alpha;
    }
  }
}

TEST(LiveLobe, HasThePeakOfPhongsLobe) {
  // Of cos^s(a) cos(theta + a), found here by a search that knows nothing of the closed form.
  for (const double exponent : {100.0, 1000.0}) {
    for (const double theta : {0.4, 1.0, 1.3}) {
      double best = 0, value = 0;
      for (double a = -0.6; a < 0; a += 1e-5) {
        const double here = std::pow(std::cos(a), exponent) * std::cos(theta + a);
        if (here > value) best = a, value = here;
      }
      const LiveClosure closure = live_closures(std::cos(theta), exponent, 0, 1, 0).bent;
      // The corrections move the tilt by some 4 / exponent of itself; the search has steps of 1e-5.
      EXPECT_NEAR(std::atan(closure.tilt), -best / 2, 5 / exponent * -best / 2 + 1e-5);
      const Parameters lobe = interpolated(exponent, 0);
      EXPECT_NEAR(live_lobe(lobe, at_angle(-theta - best), at_angle(theta))[0] / value, 1,
                  // Those of the weight are as small.
                  4 / exponent)
          << exponent << " " << theta;
    }
  }
}

TEST(LiveLobe, HasThePeakOfTheFormulaWhenNarrow) {
  for (const double alpha : {0.0, 0.5, 1.0}) {
    for (const std::optional<double> ior : {std::optional<double>(), std::optional(1.5)}) {
      for (const double theta : {0.0, 0.5, 1.1}) {
        const Parameters lobe = interpolated(3000, alpha, ior);
        const Vector3 wo = at_angle(theta);
        // What second order leaves out is of the order of tan^2 / s = 1e-3.
        for (const double a : {-0.01, 0.0, 0.01}) {
          const Vector3 wi = at_angle(-theta - a);
          EXPECT_NEAR(live_lobe(lobe, wi, wo)[0] / formula(lobe, wi, wo), 1, 2e-3);
          const Vector3 beside = (at_angle(-theta) + Vector3(0, 0.01, 0)).normalized();
          EXPECT_NEAR(live_lobe(lobe, beside, wo)[0] / formula(lobe, beside, wo), 1, 2e-3);
        }
      }
    }
  }
}

TEST(LiveLobe, IsIsotropicAtNormalIncidence) {
  for (const double exponent : {0.0, 3.0, 200.0}) {
    for (const double ior : {1.01, 1.5, 3.0}) {
      const LiveClosures closures = live_closures(1, exponent, 0.6, ior, 1);
      for (const LiveClosure& closure : {closures.bent, closures.broad}) {
        EXPECT_EQ(closure.tilt, 0);
        // Two ways to the same number, so rounding alone differs.
        EXPECT_NEAR(closure.alpha_x, closure.alpha_y, 1e-12);
      }
    }
  }
}

TEST(LiveLobe, BlendsFresnelWithOne) {
  const LiveClosures without = live_closures(0.4, 30, 0.5, 1.5, 0),
                     ignored = live_closures(0.4, 30, 0.5, 2.5, 0);
  EXPECT_EQ(without.bent.weight, ignored.bent.weight);
  EXPECT_EQ(without.broad.weight, ignored.broad.weight);
  const LiveClosures full = live_closures(1, 30, 0.5, 1.5, 1);
  const LiveClosures none = live_closures(1, 30, 0.5, 1.5, 0);
  // At normal incidence R_F has no slope, so it is a factor but for rounding.
  const double facing = fresnel_reflectance(1, 1.5).value;
  EXPECT_NEAR(full.bent.weight / none.bent.weight, facing, 1e-12);
  EXPECT_NEAR(full.broad.weight / none.broad.weight, facing, 1e-12);
}

TEST(LiveLobe, NeedsOneClosureWhereNarrow) {
  for (const double alpha : {0.0, 1.0}) {
    for (const double theta : {0.0, 0.8, 1.4}) {
      const LiveClosures closures = live_closures(std::cos(theta), 1000, alpha, 1.5, 1);
      // Exactly 0: Cycles drops the closure.
      EXPECT_EQ(closures.broad.weight, 0);
      EXPECT_GT(closures.bent.weight, 0);
    }
  }
}

TEST(LiveLobe, ChangesContinuously) {
  std::mt19937 random(2);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const auto numbers = [](const LiveClosures& closures) {
    std::vector<double> all;
    for (const LiveClosure& c : {closures.bent, closures.broad})
      all.insert(all.end(), {c.tilt, c.alpha_x, c.alpha_y, c.weight});
    return all;
  };
  for (int i = 0; i < 20000; ++i) {
    const double cosine = uniform(0.1, 0.99), exponent = std::pow(10, uniform(-2, 4));
    const double alpha = uniform(0.01, 0.99), ior = uniform(1.1, 3), fresnel = uniform(0.01, 0.99);
    const double step = 1 + 1e-7;
    const std::vector<double> here = numbers(live_closures(cosine, exponent, alpha, ior, fresnel));
    const std::vector<double> beside = numbers(
        live_closures(cosine * step, exponent * step, alpha * step, ior * step, fresnel * step));
    for (std::size_t k = 0; k < here.size(); ++k) {
      // A jump would be as large as the numbers themselves; the steepest slope is some hundred.
      ASSERT_NEAR(here[k], beside[k], 1e-4 * std::abs(here[k]) + 1e-5)
          << k << ": " << cosine << " " << exponent << " " << alpha << " " << ior << " " << fresnel;
    }
  }
}

TEST(LiveLobe, StaysNearTheFormula) {
  struct Case {
    double exponent, interpolation;
    std::optional<double> ior;
    double at_30, at_60, at_80;
  };
  // A tenth above what two closures and their fitted corrections leave: it falls as 1 / exponent
  // and is largest where the light's cosine cuts through the lobe, at grazing angles.
  const std::vector<Case> cases = {
      {0.3, 0.5, 1.5, 0.071, 0.15, 0.24},
      {1, 0, {}, 0.062, 0.12, 0.35},
      {1, 1, {}, 0.036, 0.11, 0.45},
      {1, 0.5, 1.5, 0.045, 0.14, 0.14},
      {5, 0, {}, 0.024, 0.065, 0.19},
      {5, 0.5, {}, 0.022, 0.046, 0.13},
      {5, 1, {}, 0.034, 0.039, 0.15},
      {5, 0.5, 1.5, 0.018, 0.071, 0.16},
      {50, 0, {}, 0.0026, 0.021, 0.12},
      {50, 0.5, {}, 0.0039, 0.012, 0.033},
      {50, 1, {}, 0.0051, 0.0092, 0.033},
      {50, 0.5, 1.5, 0.0042, 0.02, 0.03},
      {500, 0.5, {}, 0.00038, 0.00083, 0.0062},
      {5000, 1, 1.5, 0.000052, 0.0001, 0.00066},
  };
  for (const Case& c : cases) {
    const Parameters lobe = interpolated(c.exponent, c.interpolation, c.ior);
    EXPECT_LT(relative_error(lobe, radians(30)), c.at_30) << c.exponent << " " << c.interpolation;
    EXPECT_LT(relative_error(lobe, radians(60)), c.at_60) << c.exponent << " " << c.interpolation;
    EXPECT_LT(relative_error(lobe, radians(80)), c.at_80) << c.exponent << " " << c.interpolation;
  }
}

TEST(LiveAlbedo, IsTheIntegralOfTheLobe) {
  for (const double exponent : {0.5, 4.0, 60.0, 2000.0}) {
    for (const double alpha : {0.0, 0.6}) {
      const Parameters lobe = interpolated(exponent, alpha, 1.5);
      const Reflectance f = [&](const Vector3& wi, const Vector3& wo) {
        return Rgb(live_lobe(lobe, wi, wo) / wi.z());
      };
      for (const double theta : {0.0, 0.4, 0.8, 1.3}) {
        const LiveAlbedo albedo = live_albedo(std::cos(theta), exponent, alpha, 1.5, 1);
        // Both are sums of some thousand directions.
        EXPECT_NEAR(albedo.since_5_0 / directional_albedo(f, theta)[0], 1, 3e-3)
            << exponent << " " << alpha << " " << theta;
        EXPECT_GE(albedo.until_4_5, albedo.since_5_0);
        EXPECT_LE(albedo.until_4_5, albedo.weight * (1 + 1e-9));
        EXPECT_GT(albedo.since_5_0, albedo.weight / 2);
      }
    }
  }
}

TEST(LiveLobe, TakesEveryModelAsTheInterpolatedOne) {
  Parameters phong = interpolated(30, 0.7), blinn = phong;
  phong.kind = ModelKind::modified_phong;
  blinn.kind = ModelKind::modified_blinn_phong;
  const Vector3 wi = at_angle(0.5), wo = at_angle(-0.8);
  // The same operations: rounding alone may differ.
  EXPECT_NEAR(live_lobe(phong, wi, wo)[0],
              live_lobe(interpolated(30, 0), wi, wo)[0] * 32 / (2 * pi), 1e-13);
  EXPECT_NEAR(live_lobe(blinn, wi, wo)[0],
              live_lobe(interpolated(7.5, 1), wi, wo)[0] * 38 / (8 * pi), 1e-13);
}

TEST(LiveLobe, AddsTheDiffusePart) {
  Parameters parameters = interpolated(10, 0.5);
  parameters.specular = Rgb::Zero();
  parameters.diffuse = {0.3, 0.2, 0.1};
  const Rgb value = live_lobe(parameters, at_angle(0.6), at_angle(-0.2));
  EXPECT_TRUE(value.isApprox(parameters.diffuse / pi * std::cos(0.6), 1e-14));
}

TEST(LiveLobe, KeepsTheAlbedoOfALobeThatIsTooSharp) {
  const Parameters sharp = interpolated(50 * live_exponent_limit, 0);
  const Parameters limit = interpolated(live_exponent_limit, 0);
  const Vector3 wo = at_angle(0.3), wi = at_angle(-0.3);
  EXPECT_NEAR(live_lobe(sharp, wi, wo)[0] / live_lobe(limit, wi, wo)[0], 1.0 / 50, 1e-5);
}

TEST(LiveLobe, IsFiniteForAnyInput) {
  std::mt19937 random(1);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  for (int i = 0; i < 100000; ++i) {
    const double exponent = i % 7 ? std::pow(10, uniform(-4, 8)) : 0;
    const std::optional<double> ior =
        i % 3 ? std::optional(1 + std::pow(10, uniform(-6, 1))) : std::optional<double>(1.0);
    Parameters lobe = interpolated(exponent, i % 5 ? uniform(0, 1) : double(i % 2), ior);
    if (i % 11 == 0) lobe.ior.reset();
    const double theta = i % 4 ? uniform(0, pi / 2) : (i % 8 ? pi / 2 - 1e-12 : 0);
    const Rgb value = live_lobe(lobe, at_angle(uniform(0, pi / 2), uniform(0, 2 * pi)),
                                at_angle(theta, uniform(0, 2 * pi)));
    ASSERT_TRUE(value.isFinite().all() && (value >= 0).all()) << exponent << " " << theta;
  }
}

}  // namespace
}  // namespace lobefit
