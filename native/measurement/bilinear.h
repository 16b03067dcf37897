// Values on a regular grid over the unit square, bilinear between its points.
#pragma once

#include <algorithm>
#include <cstddef>

namespace lobefit {

// Where a point of the unit square lies on a grid of columns x rows points, x running along the
// columns. The first and the last points lie on the edges; a point outside is moved to them.
struct GridCell {
  // Both columns and rows are 2 or more.
  GridCell(double x, double y, std::size_t columns, std::size_t rows) : stride(columns) {
    const double across = std::clamp(x, 0.0, 1.0) * static_cast<double>(columns - 1);
    const double down = std::clamp(y, 0.0, 1.0) * static_cast<double>(rows - 1);
    column = std::min(static_cast<std::size_t>(across), columns - 2);
    row = std::min(static_cast<std::size_t>(down), rows - 2);
    x_share = across - static_cast<double>(column);
    y_share = down - static_cast<double>(row);
  }

  std::size_t first() const { return row * stride + column; }

  double interpolate(const float* grid) const {
    const float* const upper = grid + first();
    const float* const lower = upper + stride;
    return (1 - y_share) * ((1 - x_share) * upper[0] + x_share * upper[1]) +
           y_share * ((1 - x_share) * lower[0] + x_share * lower[1]);
  }

  std::size_t stride, column, row;
  double x_share, y_share;  // of the farther column and row, from 0 to 1
};

}  // namespace lobefit
