#include "inverse/level.h"

#include <cmath>

namespace lobefit {

Level Level::halved() const {
  Level half{grid.halved(), {}, channels, saturated, noise / 2};
  const auto count = static_cast<std::size_t>(channels);
  half.values.assign(half.grid.size() * count, 0.0f);
  std::vector<int> pixels(half.grid.size(), 0);
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      if (!grid.shows(row, column)) continue;
      const std::size_t wide = half.grid.at(row / 2, column / 2);
      ++pixels[wide];
      const float* fine = values_at(grid.at(row, column));
      for (std::size_t c = 0; c < count; ++c) {
        half.values[wide * count + c] += std::expm1(fine[c]);
      }
    }
  }
  for (std::size_t i = 0; i < half.values.size(); ++i) {
    const int summed = std::max(pixels[i / count], 1);
    half.values[i] = std::log1p(half.values[i] / static_cast<float>(summed));
  }
  return half;
}

Level level_of(const Pictures& pictures, const ReflectanceMap& map, double noise) {
  Level level{pictures.grid,
              {},
              map.channels(),
              map.compressed(pictures.saturation),
              static_cast<float>(noise / map.floor())};
  level.values.reserve(level.grid.size() * static_cast<std::size_t>(level.channels));
  for (std::size_t pixel = 0; pixel < level.grid.size(); ++pixel) {
    for (const std::vector<float>& values : pictures.values) {
      for (std::size_t c = 0; c < 3; ++c) {
        level.values.push_back(map.compressed(values[3 * pixel + c]));
      }
    }
  }
  return level;
}

}  // namespace lobefit
