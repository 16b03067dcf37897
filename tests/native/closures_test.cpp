#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "closures/closure_set.h"
#include "closures/fit_closures.h"
#include "closures/microfacet.h"
#include "closures/microfacet_terms.inc"
#include "closures/target.h"
#include "closures/view_curve.h"
#include "closures/world_excess.h"
#include "reflectance/abc.h"

namespace lobefit {
namespace {

constexpr Distribution both[] = {Distribution::ggx, Distribution::beckmann};

Vector3 at_angle(double theta, double phi = 0) {
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

double evaluate(Distribution distribution, const Shape& shape, const Vector3& wi,
                const Vector3& wo) {
  return Microfacet(distribution, shape, wo).evaluate(wi, (wi + wo).normalized());
}

// Smith's slope (alpha tan theta)^2 of a direction above a bent normal.
double smith_slope(const Shape& shape, const Vector3& w) {
  const Vector3 normal = Vector3(shape.tilt, 0, 1).normalized();
  const Vector3 tangent(normal.z(), 0, -normal.x());
  const double z = w.dot(normal);
  return (std::pow(std::exp(shape.log_alpha_x) * w.dot(tangent), 2) +
          std::pow(std::exp(shape.log_alpha_y) * w.y(), 2)) /
         (z * z);
}

RgbCurve grey(double value) { return {ViewCurve(value), ViewCurve(value), ViewCurve(value)}; }

// A GGX closure whose curves vary with the view, isotropic at normal incidence.
ClosureSet known_closures() {
  const auto curve = [](double (*function)(double)) {
    return ViewCurve::following(function, 1e-5);
  };
  SpecularClosure closure;
  closure.roughness = curve([](double c) { return 0.45 - 0.1 * c; });
  closure.anisotropy = curve([](double c) { return 0.3 * (1 - c * c); });
  closure.bend = curve([](double c) { return 0.1 + 0.1 * c; });
  closure.weight = {curve([](double c) { return 0.9 - 0.3 * c; }),
                    curve([](double c) { return 0.7 - 0.2 * c; }), ViewCurve(0.4)};
  return {grey(0), {closure}};
}

// By a function of its own, which remembers nothing.
Rgb evaluate_closures(const ClosureSet& closures, const Vector3& wi, const Vector3& wo) {
  return closures_reflectance(closures)(wi, wo);
}

// f of closures: a target is without the light's cosine.
Reflectance reflectance_of(const ClosureSet& closures) {
  return [=](const Vector3& wi, const Vector3& wo) {
    return Rgb(evaluate_closures(closures, wi, wo) / wi.z());
  };
}

FittedClosures fitted(const Target& target, const ClosureFitOptions& options) {
  Monitor monitor;
  return fit_closures(target, options, monitor);
}

void expect_equal(const ViewCurve& a, const ViewCurve& b) {
  ASSERT_EQ(a.points().size(), b.points().size());
  for (std::size_t i = 0; i < a.points().size(); ++i) {
    EXPECT_EQ(a.points()[i].cosine, b.points()[i].cosine);
    EXPECT_EQ(a.points()[i].value, b.points()[i].value);
  }
}

TEST(ClosuresMicrofacet, DerivativesAreThoseOfTheValue) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> part(0, 1);
  int compared = 0;
  for (int i = 0; i < 4000; ++i) {
    const Distribution distribution = both[i % 2];
    const Shape shape{-3 * part(random), -3 * part(random), 1.2 * part(random) - 0.4};
    const Vector3 wo = at_angle(1.5 * part(random));
    const Vector3 wi = at_angle(1.5 * part(random), 2 * pi * part(random));
    const Vector3 half = (wi + wo).normalized();
    constexpr double step = 1e-5;
    const auto near_step = [&](const Vector3& w) {
      return std::abs(smith_slope(shape, w) / 0.39 - 1) < 0.01;
    };
    // At the closure's own horizon no step is small.
    const Vector3 normal = Vector3(shape.tilt, 0, 1).normalized();
    if (normal.dot(wi) < 0.1 || normal.dot(wo) < 0.1) continue;
    // Lambda of Beckmann jumps there.
    if (distribution == Distribution::beckmann && (near_step(wi) || near_step(wo))) continue;
    const auto value =
        closure_value<true, double>(Microfacet(distribution, shape, wo).terms(),
                                    {wi.x(), wi.y(), wi.z()}, {half.x(), half.y(), half.z()});
    if (value.value < 1e-9) continue;
    EXPECT_EQ(value.value, evaluate(distribution, shape, wi, wo));
    const auto difference = [&](double Shape::*parameter) {
      Shape less = shape, more = shape;
      less.*parameter -= step;
      more.*parameter += step;
      return std::log(evaluate(distribution, more, wi, wo) / evaluate(distribution, less, wi, wo)) /
             (2 * step);
    };
    // Central differences are off by the square of the step times third derivatives, which grow
    // with the steepness of the logarithm.
    const auto expect_near = [](double derivative, double by_difference) {
      EXPECT_NEAR(derivative, by_difference, 1e-6 * (1 + std::abs(by_difference)));
    };
    expect_near(value.by_log_alpha_x / value.value, difference(&Shape::log_alpha_x));
    expect_near(value.by_log_alpha_y / value.value, difference(&Shape::log_alpha_y));
    expect_near(value.by_tilt / value.value, difference(&Shape::tilt));
    ++compared;
  }
  EXPECT_GT(compared, 2000);
}

TEST(ClosuresMicrofacet, IsReciprocalButForTheCosine) {
  for (const Distribution distribution : both) {
    // Light and viewer on the same meridian, so that both see the tangent alike.
    const Shape shape{std::log(0.5), std::log(0.2), 0};
    const Vector3 a = at_angle(1.2), b = at_angle(0.7);
    // Rounding alone differs.
    EXPECT_NEAR(evaluate(distribution, shape, a, b) * b.z(),
                evaluate(distribution, shape, b, a) * a.z(), 1e-13);
    const Shape isotropic{std::log(0.4), std::log(0.4), 0};
    const Vector3 c = at_angle(0.9, 2);
    const Vector3 turned_b = at_angle(0.7, -2), turned_c = at_angle(0.9);
    EXPECT_NEAR(evaluate(distribution, isotropic, c, b) * b.z(),
                evaluate(distribution, isotropic, turned_b, turned_c) * c.z(), 1e-13);
  }
}

TEST(ClosuresMicrofacet, IsDarkBelowItsOwnHorizon) {
  for (const Distribution distribution : both) {
    const Shape shape{std::log(0.5), std::log(0.5), 1};
    EXPECT_EQ(evaluate(distribution, shape, at_angle(-0.8), at_angle(0.2)), 0);
    EXPECT_EQ(evaluate(distribution, {-1, -1, -1}, at_angle(0), at_angle(0.8)), 0);
  }
}

TEST(ClosuresMicrofacet, ReflectsNoMoreThanItReceives) {
  constexpr int rings = 120, sectors = 60;
  for (const Distribution distribution : both) {
    for (const double alpha_x : {0.05, 0.3, 1.0}) {
      for (const double alpha_y : {0.05, 0.3, 1.0}) {
        for (const double angle : {0.0, 0.5, 1.0, 1.4}) {
          const Shape shape{std::log(alpha_x), std::log(alpha_y), 0};
          const Vector3 wo = at_angle(angle);
          const Microfacet closure(distribution, shape, wo);
          double albedo = 0;
          for (int ring = 0; ring < rings; ++ring) {
            const double t = (ring + 0.5) / rings, theta = t * t * pi / 2;
            for (int sector = 0; sector < sectors; ++sector) {
              const Vector3 half = at_angle(theta, 2 * pi * (sector + 0.5) / sectors);
              const double incidence = wo.dot(half);
              const Vector3 wi = 2 * incidence * half - wo;
              if (!(incidence > 0 && wi.z() > 0)) continue;
              albedo += closure.evaluate(wi, half) * 4 * incidence * std::sin(theta) *
                        (t * pi / rings) * (2 * pi / sectors);
            }
          }
          // Quadrature is off by a thousandth, and Beckmann's approximate Lambda by a little more.
          EXPECT_LT(albedo, 1.005) << alpha_x << ' ' << alpha_y << ' ' << angle;
          // Hardly any light is masked where the closure is smooth and faces the viewer.
          const double least = std::max(alpha_x, alpha_y) < 0.1 && angle == 0 ? 0.99 : 0.3;
          EXPECT_GT(albedo, least) << alpha_x << ' ' << alpha_y << ' ' << angle;
        }
      }
    }
  }
}

TEST(Closures, SocketsAndShapesAreInverse) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> part(0, 1);
  for (int i = 0; i < 1000; ++i) {
    // An anisotropy of 0.99 is the most that the node takes: alphas 1e4 apart.
    const Vector3 wo = at_angle(0.01 + 1.55 * part(random));
    const double tilt = std::min(2 * part(random) - 1, 0.8 * wo.x() / wo.z());
    const Shape shape{-4 * part(random), -4 * part(random), tilt};
    const ClosureSockets sockets = to_sockets(shape, wo);
    const Shape back = to_shape(sockets, wo);
    // The normal is tilted as that of the shape: n + bend wo is along (tilt, 0, 1).
    const Vector3 normal = Vector3::UnitZ() + sockets.bend * wo;
    EXPECT_NEAR(normal.x(), tilt * normal.z(), 1e-12);
    EXPECT_GT(normal.z(), 0);
    EXPECT_NEAR(back.log_alpha_x, shape.log_alpha_x, 1e-12);
    EXPECT_NEAR(back.log_alpha_y, shape.log_alpha_y, 1e-12);
    EXPECT_NEAR(back.tilt, shape.tilt, 1e-12);
    EXPECT_LE(std::abs(sockets.anisotropy), 0.99);
  }
}

TEST(Closures, SocketsAreThoseOfTheNode) {
  // alpha = Roughness^2; with Anisotropy A >= 0 it is times (1 - A) along the tangent, over (1 - A)
  // across it, and the other way round for A < 0; what exceeds 1 is clipped.
  const Vector3 wo(0.6, 0, 0.8);
  const Shape along = to_shape({0.5, 0.5, 0}, wo), across = to_shape({0.5, -0.5, 2}, wo);
  EXPECT_NEAR(std::exp(along.log_alpha_x), 0.125, 1e-12);
  EXPECT_NEAR(std::exp(along.log_alpha_y), 0.5, 1e-12);
  EXPECT_NEAR(std::exp(across.log_alpha_x), 0.5, 1e-12);
  EXPECT_NEAR(std::exp(across.log_alpha_y), 0.125, 1e-12);
  EXPECT_NEAR(across.tilt, 1.2 / 2.6, 1e-12);
  EXPECT_EQ(to_shape({0.9, 0.8, 0}, wo).log_alpha_y, 0);
  EXPECT_EQ(to_sockets({-1, -1, 0.3}, Vector3::UnitZ()).bend, 0);
}

TEST(Closures, TheViewMayStandAnywhere) {
  const ClosureSet closures = known_closures();
  const Vector3 wi = at_angle(0.7, 0.4), wo = at_angle(0.9, 0);
  const Vector3 turned_wi = at_angle(0.7, 2.5), turned_wo = at_angle(0.9, 2.1);
  const Rgb value = evaluate_closures(closures, wi, wo);
  // Rounding alone differs.
  EXPECT_TRUE(value.isApprox(evaluate_closures(closures, turned_wi, turned_wo), 1e-12));
  EXPECT_TRUE((evaluate_closures(closures, -wi, wo) == 0).all());
  EXPECT_TRUE((evaluate_closures(closures, wi, -wo) == 0).all());
}

// A function of closures remembers the last view: another view, and other closures, are not it.
TEST(Closures, AFunctionOfThemGivesWhatTheyGive) {
  const ClosureSet closures = known_closures();
  ClosureSet others = closures;
  others.specular[0].roughness = ViewCurve(0.5);
  const Reflectance f = closures_reflectance(closures), g = closures_reflectance(others);
  const Vector3 first = at_angle(0.9, 2.1), second = at_angle(0.4);
  for (const Vector3& wo : {first, first, second, Vector3(-second), first}) {
    for (const double angle : {0.7, 0.2}) {
      const Vector3 wi = at_angle(angle, 2.5);
      EXPECT_TRUE((f(wi, wo) == evaluate_closures(closures, wi, wo)).all());
      EXPECT_TRUE((g(wi, wo) == evaluate_closures(others, wi, wo)).all());
    }
  }
}

// Where a function is read, a step of the tables or a point between them, makes no difference.
TEST(ClosuresViewCurve, IsLinearBetweenItsPoints) {
  const ViewCurve curve({{0.1, 1}, {0.1017, 3}, {0.25, 2}, {0.9, 4}});
  const std::pair<double, double> known[] = {{0, 1},         {0.1, 1},  {0.1017, 3},
                                             {0.17585, 2.5}, {0.25, 2}, {0.251, 2 + 0.002 / 0.65},
                                             {0.575, 3},     {0.9, 4},  {1, 4}};
  for (const auto& [cosine, value] : known) EXPECT_NEAR(curve(cosine), value, 1e-12) << cosine;
  EXPECT_EQ(ViewCurve(7.0)(0.3), 7);
}

TEST(ClosuresViewCurve, FollowsWithinItsTolerance) {
  const auto function = [](double c) { return std::sqrt(c) + 0.1 * std::sin(12 * c); };
  std::size_t most = 258;
  for (const double tolerance : {1e-4, 1e-3, 1e-2}) {
    const ViewCurve curve = ViewCurve::following(function, tolerance);
    for (int i = 0; i <= 256; ++i) {
      const double cosine = i / 256.0;
      EXPECT_LE(std::abs(curve(cosine) - function(cosine)), tolerance * (1 + 1e-9));
    }
    EXPECT_EQ(curve.points().front().cosine, 0);
    EXPECT_EQ(curve.points().back().cosine, 1);
    EXPECT_LT(curve.points().size(), most);
    most = curve.points().size();
  }
}

TEST(ClosuresViewCurve, AConstantIsOnePoint) {
  const ViewCurve curve = ViewCurve::following([](double c) { return 3 + 1e-4 * c; }, 1e-4);
  EXPECT_TRUE(curve.constant());
  EXPECT_NEAR(curve(0.3), 3, 1e-4);
  EXPECT_EQ(curve(0.3), curve(0.8));
}

TEST(ClosuresViewCurve, PointsStandOnTheEntriesOfTables) {
  const ViewCurve curve = ViewCurve::following([](double c) { return std::sqrt(c); }, 1e-3);
  for (const auto& point : curve.points()) {
    EXPECT_EQ(point.cosine * 256, std::round(point.cosine * 256));
  }
}

TEST(ClosuresViewCurve, SplinesSumToOne) {
  constexpr int count = ViewSplines::coarse;
  for (int i = 0; i <= 1000; ++i) {
    const auto [first, share] = ViewSplines::at(i / 1000.0, count);
    EXPECT_GE(first, 0);
    EXPECT_LE(first + share.size(), count);
    EXPECT_GE(share.minCoeff(), 0);
    EXPECT_NEAR(share.sum(), 1, 1e-15);
    EXPECT_NEAR(ViewSplines::evaluate(Eigen::VectorXd::Ones(count), i / 1000.0), 1, 1e-15);
  }
}

TEST(ClosuresViewCurve, SplinesOfHalfTheWidthMakeTheSameCurve) {
  Eigen::VectorXd wavy(ViewSplines::coarse);
  for (int i = 0; i < wavy.size(); ++i) wavy[i] = std::sin(5.0 * i);
  const Eigen::VectorXd finer = ViewSplines::subdivided(wavy);
  for (int i = 0; i <= 1000; ++i) {
    EXPECT_NEAR(ViewSplines::evaluate(finer, i / 1000.0), ViewSplines::evaluate(wavy, i / 1000.0),
                1e-14);
  }
}

TEST(ClosuresViewCurve, ASingleCoefficientIsAConstant) {
  EXPECT_EQ(ViewSplines::evaluate(Eigen::VectorXd::Constant(1, 3), 0.4), 3);
}

TEST(ClosuresTarget, BlackHasTheErrorOne) {
  for (const std::string_view name : {"nickel", "red-fabric2"}) {
    const auto measurement = sample_measurement(name);
    const Target target = sample_target(
        [&](const Vector3& wi, const Vector3& wo) { return measurement.evaluate(wi, wo); });
    EXPECT_NEAR(error_of(target, [](const Vector3&, const Vector3&) { return Rgb(Rgb::Zero()); }),
                1, 1e-12);
  }
}

TEST(ClosuresTarget, ScaleCountsForNothing) {
  ClosureSet closures = known_closures();
  const Reflectance f = reflectance_of(closures);
  const Target target = sample_target(f);
  const Target scaled =
      sample_target([&](const Vector3& wi, const Vector3& wo) { return Rgb(1000 * f(wi, wo)); });
  EXPECT_LT(error_of(target, closures_reflectance(closures)), 1e-12);
  closures.specular[0].roughness = ViewCurve(0.5);
  const double error = error_of(target, closures_reflectance(closures));
  EXPECT_GT(error, 0.1);
  EXPECT_NEAR(error_of(scaled,
                       [&](const Vector3& wi, const Vector3& wo) {
                         return Rgb(1000 * evaluate_closures(closures, wi, wo));
                       }),
              error, 1e-9);
}

TEST(ClosuresTarget, AThinnedOneStandsForTheWhole) {
  const ClosureSet known = known_closures();
  const Target target = sample_target(reflectance_of(known));
  ClosureSet other = known;
  other.specular[0].roughness = ViewCurve(0.5);
  const double error = error_of(target, closures_reflectance(other));
  // Broad lobes on a 15th of the samples: the sums differ by less than the views do.
  EXPECT_NEAR(error_of(thinned(target, 3, 5), closures_reflectance(other)), error, 0.1 * error);
  EXPECT_EQ(thinned(target, 3, 1).size(), target.size() / 3);
}

TEST(ClosuresTarget, ANarrowHighlightIsSeenFromTwiceAsManyViews) {
  const auto lobe = [](double exponent) -> Reflectance {
    return [exponent](const Vector3& wi, const Vector3& wo) {
      return Rgb(Rgb::Constant(std::pow((wi + wo).normalized().z(), exponent)));
    };
  };
  const Target broad = sample_target(lobe(200)), narrow = sample_target(lobe(20000));
  EXPECT_EQ(narrow.size(), 2 * broad.size());
  const auto lights = [](const Target& target) {
    std::size_t sum = 0;
    for (const TargetView& view : target) sum += view.lights.size();
    return static_cast<double>(sum);
  };
  // But for how many are below the horizon.
  EXPECT_NEAR(lights(narrow), lights(broad), 0.02 * lights(broad));
  const double sixth = lights(thinned(broad, 3, 2));
  EXPECT_NEAR(lights(thinned(narrow, 3, 2)), sixth, 0.05 * sixth);
  const auto other = [of = lobe(15000)](const Vector3& wi, const Vector3& wo) {
    return Rgb(of(wi, wo) * wi.z());
  };
  const double error = error_of(narrow, other);
  // A sixth of the samples: the sums differ by less than the views do.
  EXPECT_NEAR(error_of(thinned(narrow, 3, 2), other), error, 0.1 * error);
}

TEST(ClosuresTarget, UnknownLightsAreLeftOut) {
  const Target target = sample_target([](const Vector3& wi, const Vector3&) {
    return Rgb(Rgb::Constant(wi.y() > 0 ? 1 : std::nan("")));
  });
  ASSERT_FALSE(target.empty());
  for (const TargetView& view : target) {
    for (const TargetLight& light : view.lights) EXPECT_GT(light.wi.y(), 0);
  }
}

TEST(ClosuresFit, FindsWhatIsKnown) {
  const ClosureSet known = known_closures();
  const Target target = sample_target(reflectance_of(known));
  const FittedClosures one = fitted(target, {.specular = 1, .threads = 1});
  EXPECT_LT(one.error, 0.005);
  ASSERT_EQ(one.closures.specular.size(), 1u);
  EXPECT_EQ(one.closures.specular[0].distribution, Distribution::ggx);
  for (const double cosine : {0.3, 0.6, 0.9}) {
    const SpecularClosure &found = one.closures.specular[0], &expected = known.specular[0];
    // What an error of half a percent leaves of the parameters.
    EXPECT_NEAR(found.roughness(cosine), expected.roughness(cosine), 0.005);
    EXPECT_NEAR(found.weight[1](cosine), expected.weight[1](cosine), 0.01);
  }

  const FittedClosures again = fitted(target, {.specular = 1, .threads = 2});
  EXPECT_EQ(again.error, one.error);
  ASSERT_EQ(again.closures.specular.size(), one.closures.specular.size());
  const SpecularClosure &a = one.closures.specular[0], &b = again.closures.specular[0];
  expect_equal(a.roughness, b.roughness);
  expect_equal(a.anisotropy, b.anisotropy);
  expect_equal(a.bend, b.bend);
  for (std::size_t c = 0; c < 3; ++c) expect_equal(a.weight[c], b.weight[c]);
}

// The lesser one is wider across the plane of incidence and bent away from the viewer, about as
// NP-MERL special-walnut-224's are.
TEST(ClosuresFit, FindsTwoThatOverlap) {
  const auto curve = [](double (*function)(double)) {
    return ViewCurve::following(function, 1e-5);
  };
  SpecularClosure lesser, greater;
  lesser.roughness = curve([](double c) { return 0.38 + 0.08 * c; });
  lesser.anisotropy = curve([](double c) { return 0.5 * (1 - c * c); });
  lesser.bend = curve([](double c) { return -0.25 * c; });
  lesser.weight = grey(0.01);
  greater.roughness = ViewCurve(0.47);
  greater.anisotropy = curve([](double c) { return 0.15 * (1 - c * c); });
  greater.bend = ViewCurve(0.03);
  greater.weight = {curve([](double c) { return 0.05 - 0.03 * c; }),
                    curve([](double c) { return 0.05 - 0.03 * c; }),
                    curve([](double c) { return 0.05 - 0.03 * c; })};
  const Target target = sample_target(reflectance_of({grey(0.003), {lesser, greater}}));
  // One closure leaves .05. Curves may be off by a part of the error, a ten-thousandth at least.
  EXPECT_LT(fitted(target, {.specular = 2, .threads = 2}).error, 0.005);
  EXPECT_GT(fitted(target, {.specular = 1, .threads = 2}).error, 0.03);
}

TEST(ClosuresFit, AddsNoEnergy) {
  const auto measurement = sample_measurement("nickel");
  const Target target = sample_target(
      [&](const Vector3& wi, const Vector3& wo) { return measurement.evaluate(wi, wo); });
  for (const SeenAtAngle& at : fitted(target, {.specular = 1}).by_view) {
    for (int c = 0; c < 3; ++c) {
      EXPECT_LE(at.closures_albedo[c], 1.02 * at.target_albedo[c]) << at.cosine;
    }
  }
}

TEST(ClosuresFit, CapsTheAlbedoWhereItIsAskedTo) {
  ClosureSet bright = known_closures();
  bright.specular[0].weight = grey(1.6);
  const Target target = sample_target(reflectance_of(bright));
  const auto greatest = [&](bool cap) {
    double most = 0;
    for (const auto& at : fitted(target, {.specular = 1, .cap_albedo = cap}).by_view) {
      most = std::max(most, at.closures_albedo.maxCoeff());
    }
    return most;
  };
  EXPECT_GT(greatest(false), 1.2);
  // The curve of the weight keeps to a 500th.
  EXPECT_LE(greatest(true), 1.005);
}

TEST(ClosuresFit, IsBentOnlySoFarThatAWhiteWorldShowsWhatLampsDo) {
  // Phong's lobe of exponent 1, whose nearest closures are bent so far that a world shows 1.7 %
  // more.
  const Target target = sample_target([](const Vector3& wi, const Vector3& wo) -> Rgb {
    return Rgb::Constant(std::max(0.0, wi.z() * wo.z() - wi.x() * wo.x() - wi.y() * wo.y()));
  });
  const FittedClosures found = fitted(target, {.specular = 2, .threads = 3});
  ASSERT_EQ(found.closures.specular.size(), 2);
  double most_bent = 0;
  for (const SeenAtAngle& at : found.by_view) {
    if (at.cosine < std::cos(80 * pi / 180)) continue;
    const Vector3 wo(std::sqrt(1 - square(at.cosine)), 0, at.cosine);
    std::vector<Microfacet> closures;
    Eigen::Matrix3Xd weights(3, 3);
    for (const SpecularClosure& closure : found.closures.specular) {
      const ClosureSockets sockets{closure.roughness(at.cosine), closure.anisotropy(at.cosine),
                                   closure.bend(at.cosine)};
      const Shape shape = to_shape(sockets, wo);
      most_bent = std::max(most_bent, shape.tilt);
      weights.col(static_cast<Eigen::Index>(closures.size()))
          .setConstant(closure.weight[1](at.cosine));
      closures.emplace_back(closure.distribution, shape, wo);
    }
    weights.col(2).setConstant(found.closures.diffuse[1](at.cosine));
    const double excess = world_excess<false>(closures, weights).albedo[1];
    EXPECT_LE(excess, 0.01 * at.closures_albedo[1]) << at.cosine;
  }
  EXPECT_GT(most_bent, 0.2) << "nothing had to be limited";
  // Views that several threads share are added up in the same order.
  EXPECT_EQ(fitted(target, {.specular = 2, .threads = 1}).error, found.error);
}

TEST(ClosuresFit, ASingleViewAngleWithAFewLightsIsEnough) {
  const Target whole = sample_target(reflectance_of(known_closures()));
  Target single = {whole[60]};
  single.front().lights.resize(3);
  const double black =
      error_of(single, [](const Vector3&, const Vector3&) { return Rgb(Rgb::Zero()); });
  for (const int specular : {0, 1, 2, 3}) {
    EXPECT_LT(fitted(single, {.specular = specular}).error, black) << specular;
  }
}

TEST(ClosuresFit, BlackNeedsNoClosures) {
  const Target target =
      sample_target([](const Vector3&, const Vector3&) { return Rgb(Rgb::Zero()); });
  EXPECT_TRUE(target.empty());
  const FittedClosures none = fitted(target, {});
  EXPECT_EQ(none.error, 0);
  EXPECT_TRUE(none.closures.specular.empty());
  EXPECT_TRUE((evaluate_closures(none.closures, at_angle(0.2), at_angle(0.4)) == 0).all());
}

TEST(ClosuresFit, TakesAsFewAsSuffice) {
  const ClosureSet grey_diffuse{grey(0.5), {}};
  const Target target = sample_target(reflectance_of(grey_diffuse));
  Monitor monitor;
  const FittedClosures found = fit_closures_within(target, 0.01, {}, monitor);
  EXPECT_LT(found.error, 0.01);
  EXPECT_TRUE(found.closures.specular.empty());
}

TEST(ClosuresFit, CanBeCancelled) {
  const Target target = sample_target(reflectance_of(known_closures()));
  Monitor monitor;
  monitor.cancel();
  EXPECT_THROW(fit_closures(target, {}, monitor), Cancelled);
}

}  // namespace
}  // namespace lobefit
