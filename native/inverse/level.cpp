#include "inverse/level.h"

#include <cmath>

namespace lobefit {

Level Level::halved() const {
  Level half{grid.halved(), {}, channels, saturated};
  const auto count = static_cast<std::size_t>(channels);
  half.observed.assign(half.grid.size() * count, 0.0f);
  std::vector<int> pixels(half.grid.size(), 0);
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      if (!grid.shows(row, column)) continue;
      const std::size_t wide = half.grid.at(row / 2, column / 2);
      ++pixels[wide];
      const float* values = at(grid.at(row, column));
      for (std::size_t c = 0; c < count; ++c) {
        half.observed[wide * count + c] += std::expm1(values[c]);
      }
    }
  }
  for (std::size_t i = 0; i < half.observed.size(); ++i) {
    const int summed = std::max(pixels[i / count], 1);
    half.observed[i] = std::log1p(half.observed[i] / static_cast<float>(summed));
  }
  return half;
}

Level level_of(const Pictures& pictures, const ReflectanceMap& map) {
  Level level{pictures.grid, {}, map.channels(), map.compressed(pictures.saturation)};
  level.observed.reserve(level.grid.size() * static_cast<std::size_t>(level.channels));
  for (std::size_t pixel = 0; pixel < level.grid.size(); ++pixel) {
    for (const std::vector<float>& values : pictures.values) {
      for (std::size_t c = 0; c < 3; ++c) {
        level.observed.push_back(map.compressed(values[3 * pixel + c]));
      }
    }
  }
  return level;
}

}  // namespace lobefit
