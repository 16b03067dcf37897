#include "measurement/density_warp.h"

#include <algorithm>
#include <utility>

#include "measurement/bilinear.h"

namespace lobefit {
namespace {

double mix(double first, double second, double share) {
  return (1 - share) * first + share * second;
}

// The integral from 0 to x of what goes linearly from `first` at 0 to `second` at 1.
double ramp_integral(double first, double second, double x) {
  return x * (first + x / 2 * (second - first));
}

}  // namespace

DensityWarp::DensityWarp(std::vector<float> density, std::size_t columns, std::size_t rows)
    : columns_(columns), rows_(rows), density_(std::move(density)), row_integral_(density_.size()) {
  const std::size_t size = rows * columns;
  integral_.resize(density_.size() / columns);
  for (std::size_t table = 0; table < density_.size() / size; ++table) {
    float* const p = density_.data() + table * size;
    double* const along = row_integral_.data() + table * size;
    double* const down = integral_.data() + table * rows;
    for (std::size_t i = 0; i < size; ++i) {
      if (i % columns > 0) along[i] = along[i - 1] + ramp_integral(p[i - 1], p[i], 1);
    }
    for (std::size_t row = 1; row < rows; ++row) {
      const std::size_t end = (row + 1) * columns - 1;
      down[row] = down[row - 1] + ramp_integral(along[end - columns], along[end], 1);
    }
    const double whole = down[rows - 1];
    std::for_each(p, p + size, [=](float& value) { value = static_cast<float>(value / whole); });
    std::for_each(along, along + size, [=](double& value) { value /= whole; });
    std::for_each(down, down + rows, [=](double& value) { value /= whole; });
  }
}

std::array<double, 2> DensityWarp::flatten(double x, double y, const Mixture& mixture) const {
  const GridCell cell(x, y, columns_, rows_);
  double before = 0, row_total = 0, above = 0;
  for (std::size_t i = 0; i < 2; ++i) {
    const std::size_t table = mixture.table[i], at = table * rows_ * columns_ + cell.first();
    std::array<double, 2> before_at{}, total_at{};  // in the rows around y
    for (std::size_t row = 0; row < 2; ++row) {
      const std::size_t here = at + row * columns_, begin = here - cell.column;
      before_at[row] =
          row_integral_[here] + ramp_integral(density_[here], density_[here + 1], cell.x_share);
      total_at[row] = row_integral_[begin + columns_ - 1];
    }
    const double weight = mixture.weight(i);
    before += weight * mix(before_at[0], before_at[1], cell.y_share);
    row_total += weight * mix(total_at[0], total_at[1], cell.y_share);
    above += weight * (integral_[table * rows_ + cell.row] +
                       ramp_integral(total_at[0], total_at[1], cell.y_share));
  }
  return {row_total > 0 ? before / row_total : 0, above};
}

}  // namespace lobefit
