#include "preview/two_lights.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

namespace lobefit {
namespace {

constexpr int size = 65;

Rgb pixel(const std::vector<float>& picture, std::ptrdiff_t row, int column) {
  return Eigen::Map<const Eigen::Array3f>(picture.data() + 3 * (row * size + column))
      .cast<double>();
}

// The normal of the sphere seen in a pixel.
Vector3 normal(int row, int column) {
  const double x = (column + 0.5) * 2 / size - 1, y = 1 - (row + 0.5) * 2 / size;
  return {x, y, std::sqrt(1 - x * x - y * y)};
}

const Vector3 glancing = Vector3(1, 1, 1.2).normalized();
const Vector3 grazing = Vector3(-1, -1, -0.55).normalized();

TEST(TwoLights, ShadesADiffuseSphere) {
  const auto picture = render_two_lights(
      [](const Vector3& wi, const Vector3&) -> Rgb { return Rgb(1, 0.5, 0.25) * wi.z() / pi; },
      size);
  ASSERT_EQ(picture.size(), std::size_t{3} * size * size);
  for (const auto& [row, column] : {std::pair(32, 32), {10, 50}, {55, 10}, {20, 8}, {60, 40}}) {
    const Vector3 n = normal(row, column);
    const double light = std::max(0.0, n.dot(glancing)) + std::max(0.0, n.dot(grazing));
    EXPECT_TRUE(pixel(picture, row, column).isApprox(Rgb(1, 0.5, 0.25) * light / pi, 1e-6))
        << row << ' ' << column;
  }
  EXPECT_GT(pixel(picture, 14, 50)[0], 0.3) << "the upper right faces the first light";
  EXPECT_GT(pixel(picture, 54, 10)[0], 0.05) << "the second light grazes the lower left";
}

TEST(TwoLights, GivesTheReflectanceUnitDirectionsAboveTheHorizon) {
  const auto picture = render_two_lights(
      [](const Vector3& wi, const Vector3& wo) -> Rgb {
        return {wi.z(), wo.z(), (wi + wo).normalized().z()};
      },
      size);
  const Vector3 n = normal(25, 40), toward_viewer = Vector3::UnitZ();
  const Rgb expected(n.dot(glancing), n.z(), n.dot((glancing + toward_viewer).normalized()));
  EXPECT_TRUE(pixel(picture, 25, 40).isApprox(expected, 1e-6));
}

TEST(TwoLights, IsBlackOffTheSphereAndWhereNothingIsKnown) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto picture = render_two_lights(
      [nan](const Vector3& wi, const Vector3& wo) -> Rgb {
        return Rgb::Constant(wo.z() > 0.9 ? nan : wi.z());
      },
      size);
  EXPECT_TRUE((pixel(picture, 0, 0) == 0).all());
  EXPECT_TRUE((pixel(picture, 32, 32) == 0).all());
  EXPECT_GT(pixel(picture, 14, 50)[0], 0);
  EXPECT_TRUE(std::all_of(picture.begin(), picture.end(),
                          [](float value) { return std::isfinite(value); }));
}

TEST(TwoLights, AddsTheLightOfAWorldByTheAlbedo) {
  const auto diffuse = [](const Vector3& wi, const Vector3&) -> Rgb {
    return Rgb(1, 0.5, 0.25) * wi.z() / pi;
  };
  const auto dark = render_two_lights(diffuse, size), lit = render_two_lights(diffuse, size, 0.3);
  for (const auto& [row, column] : {std::pair(32, 32), {10, 50}, {55, 10}, {20, 8}}) {
    const Rgb added = pixel(lit, row, column) - pixel(dark, row, column);
    // The midpoint rule over half vectors is a thousandth off for a lobe as wide as this.
    EXPECT_TRUE(added.isApprox(0.3 * Rgb(1, 0.5, 0.25), 3e-3)) << added.transpose();
  }
  EXPECT_TRUE((pixel(lit, 0, 0) == 0).all()) << "the world itself is not shown";
}

// The albedo of f cos = g(wo.z) wi.z is pi g(wo.z), so that a steep g tells whether every view
// angle gets its own.
TEST(TwoLights, AddsTheAlbedoOfEachViewAngle) {
  const auto steep = [](const Vector3& wi, const Vector3& wo) -> Rgb {
    return Rgb::Constant(std::pow(1 - wo.z(), 5) * wi.z() / pi);
  };
  const auto dark = render_two_lights(steep, size), lit = render_two_lights(steep, size, 1);
  for (const auto& [row, column] : {std::pair(32, 32), {32, 60}, {5, 32}, {32, 64}}) {
    const double expected = std::pow(1 - normal(row, column).z(), 5);
    const double added = pixel(lit, row, column)[0] - pixel(dark, row, column)[0];
    // Linear between 48 steps of the root of the cosine, and the midpoint rule near the horizon.
    EXPECT_NEAR(added, expected, 0.01) << row << ' ' << column;
  }
}

TEST(TwoLights, PassesOnWhatTheReflectanceThrows) {
  EXPECT_THROW(render_two_lights([](const Vector3&, const Vector3&)
                                     -> Rgb { throw std::runtime_error("no such direction"); },
                                 size),
               std::runtime_error);
}

}  // namespace
}  // namespace lobefit
