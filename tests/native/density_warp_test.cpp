#include "measurement/density_warp.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "measurement/bilinear.h"

namespace lobefit {
namespace {

constexpr std::size_t columns = 5, rows = 4;

// Two densities, the second of which is zero at its first column.
std::vector<float> densities() {
  std::vector<float> values;
  for (std::size_t i = 0; i < 2 * columns * rows; ++i) {
    const auto x = static_cast<float>(i % columns), y = static_cast<float>(i / columns % rows);
    values.push_back(i < columns * rows ? 1 + x * y + std::sin(5 * x) : x * x + 0.5f * x * y);
  }
  return values;
}

double mixed_density(double x, double y, double share) {
  const std::vector<float> values = densities();
  const auto integral = [&](std::size_t table) {
    // The trapezoid rule is exact for what is bilinear between its points.
    double sum = 0;
    for (std::size_t i = 0; i < columns * rows; ++i) {
      const bool side = i % columns % (columns - 1) == 0, end = i / columns % (rows - 1) == 0;
      sum += values[table * columns * rows + i] * (side ? 0.5 : 1) * (end ? 0.5 : 1);
    }
    return sum / static_cast<double>((columns - 1) * (rows - 1));
  };
  const GridCell cell(x, y, columns, rows);
  return (1 - share) * cell.interpolate(values.data()) / integral(0) +
         share * cell.interpolate(values.data() + columns * rows) / integral(1);
}

TEST(DensityWarp, IsThePairOfDistributionFunctions) {
  const DensityWarp warp(densities(), columns, rows);
  constexpr int steps = 600;
  for (const double share : {0.0, 0.3, 1.0}) {
    for (const auto& [x, y] : {std::pair{0.31, 0.62}, {0.77, 0.05}, {0.05, 0.97}, {0.5, 0.5}}) {
      double before = 0, row = 0, above = 0;
      for (int i = 0; i < steps; ++i) {
        const double at = (i + 0.5) / steps;
        before += x * mixed_density(at * x, y, share) / steps;
        row += mixed_density(at, y, share) / steps;
        for (int j = 0; j < 60; ++j) {
          above += y * mixed_density((j + 0.5) / 60, at * y, share) / steps / 60;
        }
      }
      const auto flat = warp.flatten(x, y, {{0, 1}, share});
      // The sums' own error, with steps across the kinks at the points of the grid.
      EXPECT_NEAR(flat[0], before / row, 1e-4);
      EXPECT_NEAR(flat[1], above, 1e-4);
    }
  }
}

TEST(DensityWarp, TakesTheSquareToTheSquare) {
  const DensityWarp warp(densities(), columns, rows);
  for (const double share : {0.0, 0.4, 1.0}) {
    const Mixture mixture{{0, 1}, share};
    // Values are float32 in the tables.
    EXPECT_NEAR(warp.flatten(1, 1, mixture)[0], 1, 1e-6);
    EXPECT_NEAR(warp.flatten(1, 1, mixture)[1], 1, 1e-6);
    EXPECT_EQ(warp.flatten(0, 0, mixture), (std::array<double, 2>{0, 0}));
  }
}

TEST(DensityWarp, AnEmptyRowHasNoShare) {
  const DensityWarp warp({0, 0, 1, 1}, 2, 2);
  EXPECT_EQ(warp.flatten(0.5, 0, {{0, 0}, 0}), (std::array<double, 2>{0, 0}));
}

}  // namespace
}  // namespace lobefit
