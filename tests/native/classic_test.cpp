#include "reflectance/classic.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace lobefit {
namespace {

Vector3 at(double degrees, double turn = 0) {
  const double angle = degrees * pi / 180;
  return {std::sin(angle) * std::cos(turn), std::sin(angle) * std::sin(turn), std::cos(angle)};
}

ClassicMaterial shiny(double exponent, bool half_vector) {
  return {Rgb(0.1, 0.2, 0.3), Rgb(0.9, 0.5, 0.0), Rgb(exponent, 2 * exponent, 1), half_vector};
}

TEST(Classic, IsTheFormulaByChannel) {
  const Rgb phong = evaluate_classic(shiny(3, false), at(50), at(20, pi));
  const double diffuse = std::cos(50 * pi / 180), mirrored = std::cos(30 * pi / 180);
  // A few roundings.
  EXPECT_NEAR(phong[0], 0.1 * diffuse + 0.9 * std::pow(mirrored, 3), 1e-14);
  EXPECT_NEAR(phong[1], 0.2 * diffuse + 0.5 * std::pow(mirrored, 6), 1e-14);
  EXPECT_NEAR(phong[2], 0.3 * diffuse, 1e-14);
  // In the plane of incidence the half vector is off by half the angle.
  const Rgb blinn = evaluate_classic(shiny(3, true), at(50), at(20, pi));
  EXPECT_NEAR(blinn[0], 0.1 * diffuse + 0.9 * std::pow(std::cos(15 * pi / 180), 3), 1e-14);
}

TEST(Classic, CutsEachTermWhereItsDotProductIsNotPositive) {
  // Light and viewer on one side, 91 and 89 degrees from the mirrored light; also for exponent 0.
  for (double exponent : {0.0, 3.0}) {
    const ClassicMaterial phong = shiny(exponent, false), blinn = shiny(exponent, true);
    const Rgb diffuse = phong.diffuse * std::cos(50 * pi / 180);
    EXPECT_TRUE((evaluate_classic(phong, at(50), at(41)) == diffuse).all());
    EXPECT_GT(evaluate_classic(phong, at(50), at(39))[0], diffuse[0]);
    EXPECT_GT(evaluate_classic(blinn, at(50), at(41))[0], diffuse[0] + 0.1);
    // Below the horizon there is nothing, though N.H is positive.
    EXPECT_TRUE((evaluate_classic(blinn, at(91), at(0)) == 0).all());
  }
}

TEST(Classic, AsReflectanceHasTheDiffuseTermOfAnAlbedo) {
  const ClassicMaterial matt{Rgb(0.3, 0.6, 0.9), Rgb::Zero(), Rgb::Ones(), false};
  const Rgb value = classic_reflectance(matt)(at(60), at(10));
  // f cos = rho / pi cos 60.
  EXPECT_NEAR(value[1], 0.6 / pi * 0.5, 1e-15);
}

TEST(MatchExponent, HasTheLimitOfSharpHighlights) {
  // Rays are 0.1 degrees apart, and between them the ratio is steps of up to 4e-3.
  for (double degrees : {0.0, 30.0, 45.0, 60.0, 75.0}) {
    const double angle = degrees * pi / 180, limit = 2 * (1 + std::pow(std::cos(angle), 2));
    EXPECT_NEAR(match_exponent(1e6, angle).exponent / 1e6, limit, 4e-3) << degrees;
  }
  EXPECT_NEAR(match_exponent(1e6).exponent / 1e6, 3.5175, 3.5e-3);
  // Facing the viewer R.V is cos 2h, for which nothing but 4 s is near.
  EXPECT_LT(match_exponent(1e3, 0.0).error, 1e-3);
}

// The mean difference over random lights in the hemisphere and random pixels of spheres.
double sampled_difference(double exponent, double blinn_exponent) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform;
  ClassicMaterial phong{Rgb::Zero(), Rgb::Ones(), Rgb::Constant(exponent), false}, blinn = phong;
  blinn.exponent = Rgb::Constant(blinn_exponent);
  blinn.half_vector = true;
  double apart = 0, total = 0;
  for (int i = 0; i < 400000; ++i) {
    const double cos_v = std::sqrt(uniform(random)), cos_l = uniform(random);
    const double turn = 2 * pi * uniform(random);
    const Vector3 viewer(std::sqrt(1 - cos_v * cos_v), 0, cos_v);
    const double sin_l = std::sqrt(1 - cos_l * cos_l);
    const Vector3 light(sin_l * std::cos(turn), sin_l * std::sin(turn), cos_l);
    const double term = evaluate_classic(phong, light, viewer)[0];
    apart += std::abs(evaluate_classic(blinn, light, viewer)[0] - term);
    total += term;
  }
  return apart / total;
}

TEST(MatchExponent, ComesNearestOverSpheres) {
  for (double exponent : {0.5, 3.0, 20.0}) {
    const ExponentMatch match = match_exponent(exponent);
    // The mean of 400,000 samples is off by up to 0.5 %.
    EXPECT_NEAR(sampled_difference(exponent, match.exponent) / match.error, 1, 0.015);
    EXPECT_NEAR(sampled_difference(exponent, 4 * exponent) / match.error_of_four, 1, 0.015);
    // Of the same samples, the match is better than its neighbours.
    for (double factor : {0.8, 1.25}) {
      EXPECT_LT(match.error, sampled_difference(exponent, match.exponent * factor) * 0.995);
    }
  }
}

TEST(MatchExponent, RisesWithTheExponentAndIsNeverWorseThanFour) {
  for (const std::optional<double> angle : {std::optional<double>(), {0.0}, {0.8}, {1.3}}) {
    double last = 0;
    for (double exponent = 0.1; exponent < 1e6; exponent *= 3) {
      const ExponentMatch match = match_exponent(exponent, angle);
      EXPECT_GT(match.exponent, exponent);
      EXPECT_GT(match.exponent, last);
      // The logarithm of the exponent is found to half the digits.
      EXPECT_LE(match.error, match.error_of_four + 1e-6);
      last = match.exponent;
    }
  }
}

}  // namespace
}  // namespace lobefit
