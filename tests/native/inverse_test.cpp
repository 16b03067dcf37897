// Normals from shading, on pictures of surfaces that are known.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "inverse/height.h"
#include "inverse/normals.h"
#include "inverse/pixel_cost.h"
#include "inverse/pixelwise.h"
#include "inverse/shading.h"
#include "inverse/stereographic.h"
#include "reflectance/classic.h"
#include "reflectance/model.h"

namespace lobefit {
namespace {

// Glossy paint: the interpolated lobe with Fresnel over a diffuse base.
Reflectance glossy() {
  Parameters parameters;
  parameters.diffuse = {0.3, 0.15, 0.1};
  parameters.specular = Rgb::Constant(20);
  parameters.exponent = Rgb::Constant(60);
  parameters.interpolation = 0.5;
  parameters.ior = 1.5;
  return [=](const Vector3& wi, const Vector3& wo) -> Rgb {
    return evaluate_model(parameters, wi, wo) * std::max(wi.z(), 0.0);
  };
}

Lighting from(const Vector3& direction) {
  return {{{direction.normalized(), Rgb(3, 2.8, 2.5)}}, Rgb::Zero(), 1};
}

// Six lights in a ring, 40 degrees from the viewer.
std::vector<Lighting> ring() {
  std::vector<Lighting> lighting;
  for (int i = 0; i < 6; ++i) {
    const double turn = i * pi / 3;
    lighting.push_back(from({std::cos(turn), std::sin(turn), 1.2}));
  }
  return lighting;
}

// A surface by its normal at x and y from -1 to 1; none where that points away from the viewer.
using Shape = std::function<Vector3(double x, double y)>;

Vector3 sphere(double x, double y) {
  const double z2 = 0.81 - x * x - y * y;
  return z2 > 0 ? Vector3(x, y, std::sqrt(z2)).normalized() : -Vector3::UnitZ();
}

// A lentil: less than half as high as a sphere's half.
Vector3 lentil(double x, double y) {
  const double z2 = 0.81 - x * x - y * y;
  return z2 > 0 ? Vector3(0.4 * x, 0.4 * y, std::sqrt(z2)).normalized() : -Vector3::UnitZ();
}

Vector3 waves(double x, double y) {
  return Vector3(-std::cos(7 * x + y) * 0.6, std::sin(5 * y - 2 * x) * 0.6, 1).normalized();
}

struct Scene {
  Pictures pictures;
  std::vector<Vector3> normals;
};

Scene scene_of(const Shape& shape, const std::vector<Lighting>& lighting, int size = 64,
               const Reflectance& reflectance = glossy()) {
  Scene scene{{{size, size, {}}, lighting, {}}, {}};
  const auto centre = [size](int index) { return (2 * index + 1.0) / size - 1; };
  for (int row = 0; row < size; ++row) {
    for (int column = 0; column < size; ++column) {
      scene.normals.push_back(shape(centre(column), -centre(row)));
      scene.pictures.grid.mask.push_back(scene.normals.back().z() > 0);
    }
  }
  const Shading shading(reflectance, lighting);
  for (const Lighting& each : lighting) {
    std::vector<float>& values = scene.pictures.values.emplace_back();
    for (const Vector3& normal : scene.normals) {
      const Rgb value = normal.z() > 0 ? shading.value(SeenPoint(normal), each) : Rgb::Zero();
      for (const double channel : value) values.push_back(static_cast<float>(channel));
    }
  }
  return scene;
}

Normals estimate(const Pictures& pictures, int threads = 2,
                 const Reflectance& reflectance = glossy()) {
  Monitor monitor;
  return estimate_normals(pictures, reflectance, {1e-3, 0, threads}, monitor);
}

// Angles between normals in degrees, in rising order.
std::vector<double> errors(const Scene& scene, const std::vector<Vector3>& normals) {
  std::vector<double> angles;
  for (std::size_t i = 0; i < normals.size(); ++i) {
    if (!scene.pictures.grid.mask[i]) continue;
    const double sine = scene.normals[i].cross(normals[i]).norm();
    angles.push_back(degrees(std::atan2(sine, scene.normals[i].dot(normals[i]))));
  }
  std::sort(angles.begin(), angles.end());
  return angles;
}

double median_error(const Scene& scene, const std::vector<Vector3>& normals) {
  const std::vector<double> angles = errors(scene, normals);
  return angles[angles.size() / 2];
}

TEST(Inverse, PlacesAndNormalsAreTheSame) {
  for (const Place& place : {Place(0, 0), Place(0.3, -0.5), Place(-0.7, 0.7)}) {
    const Vector3 normal = normal_at(place);
    EXPECT_NEAR(normal.norm(), 1, 1e-15);
    EXPECT_LT((place_of(normal) - place).norm(), 1e-15);
    for (int i = 0; i < 2; ++i) {
      const Place step = Place::Unit(i) * 1e-6;
      const Vector3 expected = (normal_at(place + step) - normal_at(place - step)) / 2e-6;
      EXPECT_LT((normal_slopes(place).col(i) - expected).norm(), 1e-9);
    }
  }
}

TEST(Inverse, TheMapHoldsWhatIsShaded) {
  std::vector<Lighting> lighting = ring();
  lighting[2].ambient = Rgb(0.1, 0.2, 0.3);
  lighting[3].exposure = 0.25;
  lighting[4].lights.push_back(lighting[0].lights[0]);
  const Reflectance reflectance = glossy();
  Monitor monitor;
  const ReflectanceMap map(reflectance, lighting, 1e-3, 2, monitor);
  const Shading shading(reflectance, lighting);
  ReflectanceMap::Values values, by_u, by_v, ahead, unused;
  for (const Place& place : {Place(0.1, 0.2), Place(-0.61, 0.33), Place(0.5, -0.7)}) {
    map.evaluate(place, values, by_u, by_v);
    for (std::size_t k = 0; k < lighting.size(); ++k) {
      const Rgb value = shading.value(SeenPoint(normal_at(place)), lighting[k]);
      for (int c = 0; c < 3; ++c) {
        const float expected = map.compressed(static_cast<float>(value[c]));
        // Interpolation between normals .4 degrees apart; a highlight's edge is sharpest.
        EXPECT_NEAR(values[3 * static_cast<int>(k) + c], expected, 2e-3) << k << ' ' << c;
      }
    }
    // A step is a twentieth of one between the table's nodes, whose slopes are of single precision.
    map.evaluate(place + Place(2e-4, 0), ahead, unused, unused);
    EXPECT_LT(((ahead - values) / 2e-4f - by_u).norm(), 0.05 * (1 + by_u.norm()));
    map.evaluate(place + Place(0, 2e-4), ahead, unused, unused);
    EXPECT_LT(((ahead - values) / 2e-4f - by_v).norm(), 0.05 * (1 + by_v.norm()));
  }
}

TEST(Inverse, TheCostIsThePenaltyAndItsDerivativesAreRight) {
  const Reflectance reflectance = glossy();
  Monitor monitor;
  const ReflectanceMap map(reflectance, ring(), 1e-3, 2, monitor);
  ReflectanceMap::Values seen, by_u, by_v;
  map.evaluate({0.3, 0.1}, seen, by_u, by_v);
  seen[0] += 0.7f, seen[5] -= 2.5f, seen[9] = 20;
  const Prior prior{Vector3(0.1, 0.2, 0.97), 3, Vector3(0.9, 0.1, 0.4).normalized(), 2};
  const PixelCost cost(map, {seen.data(), map.channels(), 15, 0.5f}, prior);
  using Residuals = Eigen::VectorXd;
  const int count = cost.NumResiduals();
  Residuals here(count), after(count), before(count);
  Eigen::Matrix<double, Eigen::Dynamic, 2> slopes(count, 2);
  for (const Place& place : {Place(0.3, 0.1), Place(-0.2, 0.4), Place(0.05, 0.6)}) {
    ASSERT_TRUE(cost(place.data(), here.data(), slopes.data()));
    for (int i = 0; i < 2; ++i) {
      const Place step = Place::Unit(i) * 1e-4;
      const Place up = place + step, down = place - step;
      cost(up.data(), after.data(), nullptr);
      cost(down.data(), before.data(), nullptr);
      // The table holds single precision.
      EXPECT_LT((slopes.col(i) - (after - before) / 2e-4).norm(), 0.02 * slopes.col(i).norm());
    }
  }
}

TEST(Inverse, SixLightsTellTheNormalsOfGlossyPaint) {
  for (const Shape& shape : {Shape(sphere), Shape(waves)}) {
    const Scene scene = scene_of(shape, ring());
    const std::vector<double> angles = errors(scene, estimate(scene.pictures).normals);
    // Pixels are exact but for single precision and the table's interpolation.
    EXPECT_LT(angles[angles.size() / 2], 0.05);
    EXPECT_LT(angles[angles.size() * 95 / 100], 0.5);
  }
}

TEST(Inverse, ShadowsAndCutHighlightsDoNotBendNormals) {
  Scene scene = scene_of(waves, ring());
  std::mt19937 random(7);
  for (std::size_t pixel = 0; pixel < scene.pictures.grid.size(); ++pixel) {
    // Two of six lights are in shadow everywhere.
    for (int i = 0; i < 2; ++i) {
      std::vector<float>& values = scene.pictures.values[random() % 6];
      std::fill_n(values.begin() + static_cast<std::ptrdiff_t>(3 * pixel), 3, 0.0f);
    }
  }
  std::size_t cut = 0;
  scene.pictures.saturation = 0.12f;
  for (std::vector<float>& values : scene.pictures.values) {
    for (float& value : values) {
      cut += value > scene.pictures.saturation;
      value = std::min(value, scene.pictures.saturation);
    }
  }
  ASSERT_GT(cut, scene.pictures.grid.size() / 4);
  const auto most = [&] {
    const std::vector<double> angles = errors(scene, estimate(scene.pictures).normals);
    return angles[angles.size() * 9 / 10];
  };
  EXPECT_LT(most(), 0.2);
  // Taken for what they show, the cut values do bend normals.
  scene.pictures.saturation = 1e30f;
  EXPECT_GT(most(), 0.4);
}

// Polished metal: dark but in its highlights.
Reflectance polished() {
  Parameters parameters;
  parameters.diffuse = Rgb::Zero();
  parameters.specular = Rgb(200, 180, 120);
  parameters.exponent = Rgb::Constant(20);
  parameters.interpolation = 0.5;
  return [=](const Vector3& wi, const Vector3& wo) -> Rgb {
    return evaluate_model(parameters, wi, wo) * std::max(wi.z(), 0.0);
  };
}

TEST(Inverse, WhereNoiseHidesAPixelItsNeighboursTell) {
  Scene scene = scene_of(waves, ring(), 96, polished());
  float brightest = 0;
  for (const std::vector<float>& values : scene.pictures.values) {
    brightest = std::max(brightest, *std::max_element(values.begin(), values.end()));
  }
  const float noise = 0.0025f * brightest;
  std::mt19937 random(3);
  std::normal_distribution<float> normal(0, noise);
  for (std::vector<float>& values : scene.pictures.values) {
    for (float& value : values) value += normal(random);
  }
  Monitor monitor;
  const Reflectance reflectance = polished();
  const auto error = [&](double told) {
    const NormalsOptions options{2 * noise, told, 2};
    return median_error(scene,
                        estimate_normals(scene.pictures, reflectance, options, monitor).normals);
  };
  const ReflectanceMap map(reflectance, scene.pictures.lighting, 2 * noise, 2, monitor);
  const Level level = level_of(scene.pictures, map, noise);
  std::vector<Vector3> alone;
  for (const Place& place : estimate_pixelwise(map, level, 2, monitor, 0, 1)) {
    alone.push_back(normal_at(place));
  }
  const double found = error(noise);
  EXPECT_LT(found, median_error(scene, alone) / 2);
  // Where noise is not known for what it is, dark pixels count as much as bright ones.
  EXPECT_LT(found, error(0) / 2);
}

TEST(Inverse, NormalsAreTheSameForAnyNumberOfThreads) {
  for (const std::vector<Lighting>& lighting : {ring(), {from({0.5, 0.4, 1})}}) {
    const Scene scene = scene_of(sphere, lighting, 40);
    const Normals one = estimate(scene.pictures, 1), three = estimate(scene.pictures, 3);
    EXPECT_EQ(one.normals, three.normals);
    EXPECT_EQ(one.heights, three.heights);
  }
}

TEST(Inverse, OneLightAndTheSilhouetteTellTheNormals) {
  for (const Shape& shape : {Shape(sphere), Shape(lentil)}) {
    const Scene scene = scene_of(shape, {from({0.5, 0.4, 1})}, 96);
    const double blown_up = median_error(scene, inflated_normals(scene.pictures.grid));
    const double found = median_error(scene, estimate(scene.pictures).normals);
    // The sphere is what the mask blown up is; of the lentil, from which that is 20 degrees off,
    // the shading has to tell, and smoothness leaves some of the way.
    EXPECT_LT(found, std::max(3.0, blown_up / 3));
  }
}

TEST(Inverse, ADiscBlownUpIsAHemisphere) {
  const Scene scene = scene_of(sphere, {from({0, 0, 1})}, 128);
  const std::vector<double> angles = errors(scene, inflated_normals(scene.pictures.grid));
  // The silhouette follows the edges of pixels, which shows in the ones beside it.
  EXPECT_LT(angles[angles.size() / 2], 0.5);
  EXPECT_LT(angles[angles.size() * 95 / 100], 3);
}

TEST(Inverse, WhatThePictureCutsIsFlatWhenBlownUp) {
  const Grid grid{20, 30, std::vector<std::uint8_t>(600, 1)};
  for (const Vector3& normal : inflated_normals(grid)) {
    EXPECT_LT((normal - Vector3::UnitZ()).norm(), 1e-6);
  }
}

TEST(Inverse, HeightsHaveTheSlopesOfTheNormals) {
  // A dome of 100 x 90 pixels, larger than what is solved without a guess.
  Grid grid{100, 90, {}};
  std::vector<Vector3> normals;
  std::vector<double> expected;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const double x = column - 40, y = 55 - row;
      grid.mask.push_back(std::hypot(x, y) < 38);
      expected.push_back(-0.012 * x * x - 0.008 * y * y);
      normals.push_back(Vector3(0.024 * x, 0.016 * y, 1).normalized());
    }
  }
  const std::vector<double> heights = integrate_normals(grid, normals);
  double lowest = 1e9, worst = 0;
  for (std::size_t i = 0; i < grid.size(); ++i) {
    if (grid.mask[i]) lowest = std::min(lowest, expected[i]);
  }
  for (std::size_t i = 0; i < grid.size(); ++i) {
    if (grid.mask[i]) worst = std::max(worst, std::abs(heights[i] - (expected[i] - lowest)));
  }
  // The dome is 17 pixels high; a slope between two pixels comes from the mean of their normals.
  EXPECT_LT(worst, 0.05);
}

TEST(Inverse, EachPartOfTheMaskStandsAtZero) {
  Grid grid{10, 21, std::vector<std::uint8_t>(210, 1)};
  for (int row = 0; row < grid.rows; ++row) grid.mask[grid.at(row, 10)] = 0;
  std::vector<Vector3> normals(grid.size(), Vector3(-0.5, 0, 1).normalized());
  const std::vector<double> heights = integrate_normals(grid, normals);
  // Conjugate gradients end within 1e-6.
  EXPECT_NEAR(heights[grid.at(4, 0)], 0, 1e-4);
  EXPECT_NEAR(heights[grid.at(4, 9)], 4.5, 1e-4);
  EXPECT_NEAR(heights[grid.at(4, 11)], 0, 1e-4);
  EXPECT_NEAR(heights[grid.at(4, 20)], 4.5, 1e-4);
  EXPECT_EQ(heights[grid.at(4, 10)], 0);
}

TEST(Inverse, ItCanBeCancelled) {
  const Scene scene = scene_of(sphere, ring(), 32);
  Monitor monitor;
  monitor.cancel();
  EXPECT_THROW(estimate_normals(scene.pictures, glossy(), {1e-3, 0, 2}, monitor), Cancelled);
}

}  // namespace
}  // namespace lobefit
