#include "closures/principled.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "closures/principled_kernel.h"
#include "closures/principled_terms.inc"
#include "measurement/instructions.h"
#include "perturb_principled.h"
#include "reflectance/abc.h"
#include "reflectance/fresnel.h"

namespace lobefit {
namespace {

Vector3 direction(double theta_degrees, double phi_degrees) {
  const double theta = radians(theta_degrees), phi = radians(phi_degrees);
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

Principled principled(const Rgb& base_color, double metallic, double roughness, double ior,
                      const Rgb& specular_tint) {
  return {base_color, metallic, roughness, ior, specular_tint, 0};
}

// The reflectance of a Principled BSDF, without the cosine.
Reflectance reflectance_of(const Principled& material) {
  return [material](const Vector3& wi, const Vector3& wo) -> Rgb {
    return evaluate_principled(material, wi, wo) / wi.z();
  };
}

Target uniform_target(double value) {
  return sample_target(
      [value](const Vector3&, const Vector3&) -> Rgb { return Rgb::Constant(value); });
}

Rgb albedo(const Principled& material, const Vector3& wo) {
  constexpr int rings = 180, sectors = 180;
  Rgb sum = Rgb::Zero();
  for (int ring = 0; ring < rings; ++ring) {
    const double theta = 90 * (ring + 0.5) / rings;
    for (int sector = 0; sector < sectors; ++sector) {
      const Vector3 wi = direction(theta, 360 * (sector + 0.5) / sectors);
      sum += std::sin(radians(theta)) * evaluate_principled(material, wi, wo);
    }
  }
  return sum * (pi / 2 / rings) * (2 * pi / sectors);
}

void expect_legal(const Principled& fit) {
  EXPECT_TRUE((fit.base_color >= 0).all() && (fit.base_color <= 1).all()) << fit.base_color;
  EXPECT_TRUE((fit.specular_tint >= 0).all() && (fit.specular_tint <= 1).all());
  EXPECT_TRUE(fit.metallic >= 0 && fit.metallic <= 1) << fit.metallic;
  EXPECT_TRUE(fit.roughness >= 0.03 - 1e-12 && fit.roughness <= 1) << fit.roughness;
  EXPECT_TRUE(fit.ior >= 1 && fit.ior <= 99 + 1e-9) << fit.ior;
  EXPECT_TRUE(std::isfinite(fit.error));
}

TEST(Principled, WithoutACoatIsLambert) {
  const Rgb color(0.8, 0.3, 0.1);
  const Vector3 wi = direction(50, 20), wo = direction(30, 140);
  const Rgb value = evaluate_principled(principled(color, 0, 0.5, 1, Rgb::Ones()), wi, wo);
  EXPECT_TRUE(value.isApprox(color * wi.z() / pi, 1e-12)) << value;
}

TEST(Principled, MetalFacingItsLightHasThePeakOfGgx) {
  const Rgb color(0.8, 0.3, 0.1);
  const Vector3 n = Vector3::UnitZ();
  const Rgb value = evaluate_principled(principled(color, 1, 0.5, 1.5, Rgb::Ones()), n, n);
  EXPECT_TRUE(value.isApprox(color / (4 * pi * std::pow(0.5, 4)), 1e-12)) << value;
}

TEST(Principled, DielectricFacingItsLightReflectsTintedF0) {
  const Rgb tint(1, 0.5, 0);
  const Vector3 n = Vector3::UnitZ();
  const Rgb value = evaluate_principled(principled(Rgb::Zero(), 0, 0.5, 1.5, tint), n, n);
  EXPECT_TRUE(value.isApprox(0.04 * tint / (4 * pi * std::pow(0.5, 4)), 1e-12)) << value;
}

TEST(Principled, AMirrorShowsNoLightOfSizeZero) {
  const Vector3 n = Vector3::UnitZ();
  const Principled metal = principled(Rgb::Ones(), 1, 0, 1.5, Rgb::Ones());
  EXPECT_TRUE((evaluate_principled(metal, n, n) == 0).all());
  const Principled coated = principled(Rgb::Ones(), 0, 0, 1.5, Rgb::Ones());
  const Rgb diffuse = evaluate_principled(coated, n, n);
  // All but the coat's 4 % at normal incidence, of 1 / pi.
  EXPECT_TRUE(diffuse.isApproxToConstant(0.96 / pi, 1e-3)) << diffuse;
}

TEST(Principled, IsZeroBelowTheHorizon) {
  const Principled material = principled(Rgb::Ones(), 0.5, 0.5, 1.5, Rgb::Ones());
  EXPECT_TRUE((evaluate_principled(material, direction(95, 0), direction(20, 0)) == 0).all());
  EXPECT_TRUE((evaluate_principled(material, direction(20, 0), direction(95, 0)) == 0).all());
}

TEST(Principled, WithoutDiffusePartIsReciprocal) {
  const Rgb color(0.9, 0.5, 0.2), tint(0.3, 0.6, 1);
  for (const Principled& material :
       {principled(color, 1, 0.4, 1.5, tint), principled(Rgb::Zero(), 0, 0.4, 1.5, tint)}) {
    const Vector3 a = direction(70, 10), b = direction(25, 200);
    const Rgb there = evaluate_principled(material, a, b) / a.z();
    const Rgb back = evaluate_principled(material, b, a) / b.z();
    EXPECT_TRUE(there.isApprox(back, 1e-12)) << there << " and " << back;
  }
}

TEST(Principled, ReflectsNoMoreThanItReceives) {
  for (const double metallic : {0.0, 0.4, 1.0}) {
    for (const double roughness : {0.2, 0.5, 1.0}) {
      for (const double ior : {1.0, 1.5, 20.0}) {
        const Principled white = principled(Rgb::Ones(), metallic, roughness, ior, Rgb::Ones());
        for (const double view : {5.0, 60.0, 80.0}) {
          EXPECT_LE(albedo(white, direction(view, 0)).maxCoeff(), 1.001)
              << metallic << ' ' << roughness << ' ' << ior << ' ' << view;
        }
      }
    }
  }
}

using ByUnknown = std::array<double, PrincipledSlopes::count>;

// A channel by what it is differentiated by.
template <bool derivatives>
PrincipledChannel<double> channel_at(const ByUnknown& x, const FacetLight<double>& at,
                                     double n_wo) {
  using S = PrincipledSlopes;
  const PrincipledTerms terms = principled_terms(
      {x[S::metallic], std::exp(x[S::log_roughness]), x[S::reflectance_root], x[S::brightest_tint]},
      n_wo);
  return principled_channel<derivatives>(terms, at, principled_light<derivatives>(terms, at),
                                         x[S::base_color], x[S::specular_tint]);
}

TEST(Principled, DerivativesAreThoseOfTheValues) {
  const Vector3 wo = direction(40, 170);
  for (const Vector3& wi : {direction(55, 10), direction(38, -20), direction(80, 60)}) {
    const FacetLight<double> at = facet_light(wi, Vector3((wi + wo).normalized()));
    for (const ByUnknown& point : {ByUnknown{0.35, std::log(0.43), 0.31, 0.9, 0.7, 0.5},
                                   ByUnknown{0.9, std::log(0.2), 0.75, 0.6, 0.1, 0.2},
                                   ByUnknown{0.1, std::log(0.8), 0.02}}) {
      const PrincipledChannel<double> channel = channel_at<true>(point, at, wo.z());
      EXPECT_EQ(channel.value, channel_at<false>(point, at, wo.z()).value);
      for (std::size_t i = 0; i < point.size(); ++i) {
        constexpr double step = 1e-5;
        auto above = point, below = point;
        above[i] += step;
        below[i] -= step;
        const double slope = (channel_at<false>(above, at, wo.z()).value -
                              channel_at<false>(below, at, wo.z()).value) /
                             (2 * step);
        // What a step of 1e-5 leaves out is the third derivative's, at most some hundreds here.
        EXPECT_NEAR(channel.slopes[i], slope, 1e-7) << "derivative by unknown " << i;
      }
    }
  }
}

// The formula for lanes and the project's other one of Fresnel's reflectance cannot part.
TEST(Principled, SchlickWeightIsThatOfFresnelsReflectance) {
  for (const double root : {1e-6, 0.02, 0.2, 0.75, 0.98}) {
    const double ior = (1 + root) / (1 - root), f0 = root * root;
    for (const double cosine : {1e-3, 0.2, 0.5, 0.9, 1.0}) {
      const FresnelReflectance fresnel = fresnel_reflectance(cosine, ior);
      const auto weight = schlick_weight<true>(dielectric_terms(root), cosine);
      // At normal incidence what is 0 is the difference of numbers near 1, or held at 0.
      EXPECT_NEAR(weight.value, std::max((fresnel.value - f0) / (1 - f0), 0.0), 1e-12);
    }
  }
}

// Lights of a view in columns, with a weightless one at the end.
struct KernelLights {
  static constexpr std::size_t count = 8;
  std::array<std::array<double, count>, 9> columns;

  explicit KernelLights(const Vector3& wo) {
    for (std::size_t i = 0; i < count; ++i) {
      const auto number = static_cast<double>(i);
      const Vector3 wi = direction(10 + 9 * number, 150 + 17 * number);
      const FacetLight<double> at = facet_light(wi, Vector3((wi + wo).normalized()));
      const std::array<double, 9> light = {at.n_wi,
                                           at.wi_h,
                                           at.sin2_h,
                                           at.cos2_h,
                                           0.1 * number,
                                           0.3,
                                           0.02 * number * number,
                                           i + 1 < count ? 1 + number : 0,
                                           0.5};
      for (std::size_t k = 0; k < columns.size(); ++k) columns[k][i] = light[k];
    }
  }

  FacetLight<double> at(std::size_t i) const {
    return {columns[0][i], columns[1][i], columns[2][i], columns[3][i]};
  }
  PrincipledKernelLights pointers() const {
    const auto& c = columns;
    return {count,
            {c[0].data(), c[1].data(), c[2].data(), c[3].data()},
            {c[4].data(), c[5].data(), c[6].data()},
            c[7].data(),
            c[8].data()};
  }
};

PrincipledKernelInput kernel_input(const KernelLights& lights, double n_wo) {
  return {lights.pointers(),
          principled_terms({0.35, 0.43, 0.31, 0.9}, n_wo),
          {0.7, 0.4, 0.2},
          {0.5, 0.9, 0.3},
          0.1};
}

TEST(PrincipledKernel, SumsWhatTheFormulaGives) {
  const Vector3 wo = direction(40, 170);
  const KernelLights lights(wo);
  const PrincipledKernelInput in = kernel_input(lights, wo.z());
  const PrincipledKernelSums sums = run_principled_kernel(in);
  using Slopes = Eigen::Matrix<double, PrincipledSlopes::count, 1>;
  double error = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    Slopes gradient = Slopes::Zero();
    Eigen::Matrix<double, PrincipledSlopes::count, PrincipledSlopes::count> matrix;
    matrix.setZero();
    for (std::size_t i = 0; i < KernelLights::count; ++i) {
      const auto light = principled_light<true>(in.terms, lights.at(i));
      const auto channel = principled_channel<true>(in.terms, lights.at(i), light, in.base_color[c],
                                                    in.specular_tint[c]);
      const double r = channel.value - in.lights.reflected[c][i];
      const double e = in.smoothing * in.lights.typical[i], rounded = std::hypot(r, e);
      const Slopes slopes = Eigen::Map<const Slopes>(channel.slopes);
      error += in.lights.weight[i] * (rounded - e);
      gradient += in.lights.weight[i] / rounded * r * slopes;
      matrix += in.lights.weight[i] / rounded * slopes * slopes.transpose();
    }
    for (int j = 0; j < PrincipledSlopes::count; ++j) {
      // Eight numbers are summed; rounding them in another order makes some 1e-15.
      EXPECT_NEAR(sums.gradient[c][j], gradient[j], 1e-12 * gradient.norm());
      for (int k = 0; k <= j; ++k) {
        EXPECT_NEAR(sums.matrix[c][j][k], matrix(j, k), 1e-12 * matrix.norm());
      }
    }
  }
  EXPECT_NEAR(run_principled_error(in), error, 1e-12 * error);
}

TEST(PrincipledKernel, HasTheSameBitsInBothVersions) {
  if (!has_avx2()) GTEST_SKIP() << "the processor has no AVX2, so there is one version alone";
  const Vector3 wo = direction(40, 170);
  const KernelLights lights(wo);
  const PrincipledKernelInput in = kernel_input(lights, wo.z());
  const PrincipledKernelSums fast = run_principled_kernel(in);
  const double fast_error = run_principled_error(in);
  const BaselineInstructions baseline;
  const PrincipledKernelSums slow = run_principled_kernel(in);
  for (int c = 0; c < 3; ++c) {
    for (int j = 0; j < PrincipledSlopes::count; ++j) {
      EXPECT_EQ(fast.gradient[c][j], slow.gradient[c][j]);
      for (int k = 0; k <= j; ++k) EXPECT_EQ(fast.matrix[c][j][k], slow.matrix[c][j][k]);
    }
  }
  EXPECT_EQ(fast_error, run_principled_error(in));
}

TEST(FitPrincipled, FindsTheMaterialThatATargetIsMadeOf) {
  for (const Principled& material : {
           principled(Rgb(0.5, 0.2, 0.1), 0, 0.4, 1.5, Rgb(1, 0.9, 0.8)),
           principled(Rgb(0.9, 0.6, 0.3), 1, 0.2, 1.5, Rgb(0.9, 0.8, 0.7)),
           principled(Rgb(0.7, 0.1, 0.4), 0, 0.08, 1.8, Rgb(0.8, 0.8, 0.8)),
           principled(Rgb(0.3, 0.3, 0.6), 0, 0.8, 1.4, Rgb(0.5, 0.6, 0.7)),
       }) {
    const Principled fit = fit_principled(sample_target(reflectance_of(material)));
    expect_legal(fit);
    EXPECT_LT(fit.error, 0.002);
    EXPECT_LT((fit.base_color - material.base_color).abs().maxCoeff(), 0.01) << fit.base_color;
    EXPECT_NEAR(fit.metallic, material.metallic, 0.01);
    EXPECT_NEAR(fit.roughness, material.roughness, 0.005);
  }
}

// What no Principled BSDF is: a wide lobe below a narrow one, both coloured, and the sample of a
// published fit with its long tails.
std::vector<Target> strange_targets() {
  const Principled wide = principled(Rgb(0.5, 0.2, 0.1), 0.7, 0.6, 1.5, Rgb(1, 0.9, 0.8));
  const Principled narrow = principled(Rgb(0.2, 0.3, 0.9), 1, 0.15, 1.5, Rgb(0.9, 0.8, 0.7));
  const Reflectance two_lobes = [=](const Vector3& wi, const Vector3& wo) -> Rgb {
    return (evaluate_principled(wide, wi, wo) + evaluate_principled(narrow, wi, wo)) / wi.z();
  };
  std::vector<Target> targets = {sample_target(two_lobes)};
  for (const char* name : {"nickel", "violet-rubber"}) {
    const Measurement sample = sample_measurement(name);
    targets.push_back(sample_target(
        [&](const Vector3& wi, const Vector3& wo) { return sample.evaluate(wi, wo); }));
  }
  return targets;
}

TEST(FitPrincipled, NoPerturbationIsMuchBetter) {
  for (const Target& target : strange_targets()) {
    const Principled fit = fit_principled(target);
    expect_legal(fit);
    EXPECT_GT(fit.error, 0.01);
    EXPECT_LT(gain_of_perturbations(target, fit, 500), 0.01);
  }
}

TEST(FitPrincipled, ErrorIsThatOfClosures) {
  const Target target = strange_targets().front();
  const Principled fit = fit_principled(target);
  EXPECT_EQ(fit.error, error_of(target, [&](const Vector3& wi, const Vector3& wo) {
              return evaluate_principled(fit, wi, wo);
            }));
}

TEST(FitPrincipled, ReportsTheErrorOfBlackForWhatItCannotReach) {
  // A surface a million times brighter than white: the best is still nearly all wrong.
  const Principled fit = fit_principled(uniform_target(1e6 / pi));
  expect_legal(fit);
  EXPECT_NEAR(fit.error, 1, 1e-3);
}

TEST(FitPrincipled, GivesLegalSocketsForAnyTarget) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double value : {0.0, nan, infinity, -1.0, 1e-300, 1e-30, 1e-11, 1e30, 1e300}) {
    SCOPED_TRACE(value);
    expect_legal(fit_principled(uniform_target(value)));
  }
  // A single ray of light, and no light but at grazing angles.
  expect_legal(fit_principled(sample_target([](const Vector3& wi, const Vector3&) -> Rgb {
    return Rgb::Constant(wi.z() > 0.999 ? 1e9 : 0);
  })));
  expect_legal(fit_principled(sample_target([](const Vector3& wi, const Vector3&) -> Rgb {
    return Rgb(wi.z() < 0.05 ? 1e6 : 0, 0, 1e-9);
  })));
}

TEST(FitPrincipled, GivesLegalSocketsForAFewLights) {
  // Too few to start on a part of them.
  const Target whole = strange_targets().front();
  const Target one_view(1, whole[60]);
  expect_legal(fit_principled(one_view));
  Target one_light = one_view;
  one_light[0].lights.resize(1);
  expect_legal(fit_principled(one_light));
}

TEST(FitPrincipled, IsBlackWhereNothingShines) {
  const Principled fit = fit_principled(uniform_target(0));
  EXPECT_TRUE((evaluate_principled(fit, direction(40, 0), direction(40, 180)) == 0).all());
  EXPECT_EQ(fit.error, 0);
}

TEST(FitPrincipled, LeavesOutWhatIsNotKnown) {
  const Principled material = principled(Rgb(0.5, 0.2, 0.1), 0, 0.4, 1.5, Rgb(1, 0.9, 0.8));
  const Reflectance whole = reflectance_of(material);
  const Target half = sample_target([&](const Vector3& wi, const Vector3& wo) -> Rgb {
    return wi.y() > 0.1 ? Rgb::Constant(std::numeric_limits<double>::quiet_NaN()) : whole(wi, wo);
  });
  const Principled fit = fit_principled(half);
  EXPECT_LT(fit.error, 0.002);
  EXPECT_LT((fit.base_color - material.base_color).abs().maxCoeff(), 0.01);
}

TEST(FitPrincipled, IsTheSameForAnyNumberOfThreads) {
  for (const Target& target : strange_targets()) {
    const Principled first = fit_principled(target, 1);
    for (const int threads : {1, 2, 5}) {
      const Principled other = fit_principled(target, threads);
      EXPECT_EQ(first.error, other.error);
      EXPECT_EQ(first.roughness, other.roughness);
      EXPECT_EQ(first.ior, other.ior);
      EXPECT_TRUE((first.base_color == other.base_color).all());
    }
  }
}

}  // namespace
}  // namespace lobefit
