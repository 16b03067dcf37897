#include "reflectance/model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <random>

#include "measurement/input_error.h"
#include "reflectance/albedo.h"
#include "reflectance/fresnel.h"

namespace lobefit {
namespace {

Vector3 random_direction(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  const double z = uniform(random), phi = 2 * pi * uniform(random);
  const double r = std::sqrt(1 - z * z);
  return {r * std::cos(phi), r * std::sin(phi), z};
}

Parameters some_parameters(ModelKind kind) {
  Parameters parameters;
  parameters.kind = kind;
  parameters.diffuse = {0.3, 0.2, 0.1};
  parameters.specular = {0.4, 0.5, 0.6};
  parameters.exponent.setConstant(17);
  if (kind == ModelKind::interpolated) parameters.interpolation = 0.3;
  parameters.ior = 1.7;
  return parameters;
}

// Equations 1 to 3 as the paper writes them, from vectors.
Rgb as_the_paper_writes_it(const Parameters& p, const Vector3& wi, const Vector3& wo) {
  const Vector3 n(0, 0, 1), half = (wi + wo).normalized();
  const double mirror = (2 * wi.dot(n) * n - wi).dot(wo), blinn = half.dot(n), s = p.exponent[0];
  double lobe = 0;
  if (p.kind == ModelKind::modified_phong) {
    lobe = mirror > 0 ? (s + 2) / (2 * pi) * std::pow(mirror, s) : 0;
  } else if (p.kind == ModelKind::modified_blinn_phong) {
    lobe = (s + 8) / (8 * pi) * std::pow(blinn, s);
  } else {
    const double base = (1 - p.interpolation) * mirror + p.interpolation * std::pow(blinn, 4);
    lobe = base > 0 ? std::pow(base, s) : 0;
  }
  return p.diffuse / pi + p.specular * lobe * fresnel_reflectance(wi.dot(half), *p.ior).value;
}

class EveryModel : public ::testing::TestWithParam<ModelKind> {};
INSTANTIATE_TEST_SUITE_P(Models, EveryModel,
                         ::testing::Values(ModelKind::modified_phong,
                                           ModelKind::modified_blinn_phong,
                                           ModelKind::interpolated));

TEST_P(EveryModel, IsItsEquation) {
  std::mt19937 random(1);
  const Parameters parameters = some_parameters(GetParam());
  for (int i = 0; i < 1000; ++i) {
    const Vector3 wi = random_direction(random), wo = random_direction(random);
    const Rgb expected = as_the_paper_writes_it(parameters, wi, wo);
    EXPECT_LT((evaluate_model(parameters, wi, wo) - expected).abs().maxCoeff(), 1e-12);
  }
}

TEST_P(EveryModel, IsReciprocal) {
  std::mt19937 random(2);
  const Parameters parameters = some_parameters(GetParam());
  for (int i = 0; i < 1000; ++i) {
    const Vector3 wi = random_direction(random), wo = random_direction(random);
    const Rgb one = evaluate_model(parameters, wi, wo), other = evaluate_model(parameters, wo, wi);
    EXPECT_LT((one - other).abs().maxCoeff(), 1e-12);
  }
}

TEST_P(EveryModel, KeepsItsValueAsAnInterpolatedLobe) {
  std::mt19937 random(3);
  const Parameters parameters = some_parameters(GetParam());
  const Parameters lobe = as_interpolated(parameters);
  for (int i = 0; i < 100; ++i) {
    const Vector3 wi = random_direction(random), wo = random_direction(random);
    EXPECT_LT((evaluate_model(parameters, wi, wo) - evaluate_model(lobe, wi, wo)).abs().maxCoeff(),
              1e-12);
  }
}

TEST_P(EveryModel, HasTheNameItIsFoundBy) {
  EXPECT_EQ(model_named(name_of(GetParam())), GetParam());
}

TEST(Model, OfAnotherNameIsRefused) { EXPECT_THROW(model_named("ward"), InputError); }

TEST(Lobe, KeepsItsPrecisionAtASharpPeak) {
  // (1 - u)^s with s = 1e7 and u = 1e-8: e^-0.1 to rounding, which 1 - u in double would miss.
  const LobeCoordinates at{1e-8, 0, 1};
  EXPECT_NEAR(lobe_power(at, 0, 1e7), std::exp(1e7 * std::log1p(-1e-8)), 1e-15);
  EXPECT_EQ(lobe_power({1.5, 0, 1}, 0, 3), 0);
  EXPECT_EQ(lobe_power({0, 0, 1}, 0.5, 1e7), 1);
}

TEST(Fresnel, IsThatOfTheTwoPolarisations) {
  for (const double ior : {1.0 + 1e-9, 1.05, 1.5, 3.0, 100.0}) {
    for (double angle = 0; angle < 1.57; angle += 0.1) {
      const double c = std::cos(angle);
      // Snell and the textbook amplitudes, in long double because they cancel for ior near 1.
      const long double ci = c, n = ior;
      const long double ct = std::sqrt(1 - (1 - ci * ci) / (n * n));
      const long double s = (ci - n * ct) / (ci + n * ct), p = (n * ci - ct) / (n * ci + ct);
      const auto expected = static_cast<double>((s * s + p * p) / 2);
      const double tolerance = ior < 1.001 ? 1e-6 : 1e-12;  // what the textbook form leaves
      EXPECT_NEAR(fresnel_reflectance(c, ior).value, expected, tolerance * expected + 1e-30);
    }
  }
  EXPECT_DOUBLE_EQ(fresnel_reflectance(1, 1.5).value, 0.04);
  EXPECT_DOUBLE_EQ(fresnel_reflectance(0, 1.5).value, 1);
  EXPECT_EQ(fresnel_reflectance(0.5, 1).value, 0);
}

TEST(Fresnel, HasTheDerivativesOfItsDifferences) {
  for (const double ior : {1.05, 1.5, 3.0, 50.0}) {
    for (const double c : {0.02, 0.3, 0.7, 1.0}) {
      const double step = 1e-5 * (ior - 1);
      const double difference =
          (fresnel_reflectance(c, ior + step).value - fresnel_reflectance(c, ior - step).value) /
          (2 * step);
      // Central differences leave an error of the order of the squared relative step.
      EXPECT_NEAR(fresnel_reflectance(c, ior).derivative, difference,
                  1e-7 * std::abs(difference) + 1e-11);
      const double slopes = (fresnel_reflectance(c, ior + step).derivative -
                             fresnel_reflectance(c, ior - step).derivative) /
                            (2 * step);
      EXPECT_NEAR(fresnel_reflectance(c, ior).second_derivative, slopes,
                  1e-7 * std::abs(slopes) + 1e-11);
    }
  }
}

TEST(Albedo, OfALambertSurfaceIsItsReflectance) {
  const Reflectance lambert = [](const Vector3&, const Vector3&) -> Rgb {
    return Rgb(0.5, 0.2, 0) / pi;
  };
  for (const double angle : {0.0, 0.5, 1.2}) {
    const Rgb albedo = directional_albedo(lambert, angle);
    EXPECT_NEAR(albedo[0], 0.5, 2e-3);  // the rule's step at the horizon
    EXPECT_NEAR(albedo[1], 0.2, 1e-3);
    EXPECT_EQ(albedo[2], 0);
  }
}

TEST(Albedo, OfAPhongLobeFacingTheViewerIsKnown) {
  // The integral of cos^s cos over the hemisphere is 2 pi / (s + 2).
  for (const double s : {1.0, 50.0, 5000.0, 1e5}) {
    const Reflectance lobe = [=](const Vector3& wi, const Vector3&) -> Rgb {
      return Rgb::Constant(std::pow(std::max(wi.z(), 0.0), s));
    };
    EXPECT_NEAR(directional_albedo(lobe, 0)[0], 2 * pi / (s + 2), 2e-3 * 2 * pi / (s + 2));
  }
}

}  // namespace
}  // namespace lobefit
