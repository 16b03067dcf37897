// The map that makes a tabulated density on the unit square uniform.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace lobefit {

// Two of several tables and the share of the second.
struct Mixture {
  std::array<std::size_t, 2> table;
  double share;

  double weight(std::size_t i) const { return i == 0 ? 1 - share : share; }
};

// Tables of densities p(x, y), bilinear between the points of a regular grid over the unit square.
class DensityWarp {
 public:
  // `density` holds tables of rows x columns values, none negative, x running along the columns;
  // each table is divided by its integral, which has to be positive.
  DensityWarp(std::vector<float> density, std::size_t columns, std::size_t rows);

  // P(X <= x | Y = y) and P(Y <= y) for p the mixture of two tables: distributed as p, (x, y) goes
  // to points that are spread evenly. Where p(., y) is zero the first is 0.
  std::array<double, 2> flatten(double x, double y, const Mixture& mixture) const;

 private:
  // Integrals over x and y are in units of the grid; those of a whole table are 1.
  std::size_t columns_, rows_;
  std::vector<float> density_;
  std::vector<double> row_integral_;  // of p(., y) from 0 to x, at the points of the grid
  std::vector<double> integral_;      // of p from 0 to y, at the rows
};

}  // namespace lobefit
