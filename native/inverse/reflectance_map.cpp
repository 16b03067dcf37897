#include "inverse/reflectance_map.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "inverse/shading.h"
#include "measurement/parallel.h"

namespace lobefit {
namespace {

// Catmull and Rom's cubic: the share of four neighbours at t between the middle two, and its slope.
struct Shares {
  std::array<float, 4> value, slope;
};

Shares shares_at(float t) {
  return {{t * (-0.5f + t * (1 - 0.5f * t)), 1 + t * t * (-2.5f + 1.5f * t),
           t * (0.5f + t * (2 - 1.5f * t)), t * t * (-0.5f + 0.5f * t)},
          {-0.5f + t * (2 - 1.5f * t), t * (-5 + 4.5f * t), 0.5f + t * (4 - 4.5f * t),
           t * (-1 + 1.5f * t)}};
}

}  // namespace

ReflectanceMap::ReflectanceMap(const Reflectance& f_times_cosine,
                               const std::vector<Lighting>& lighting, double floor, int threads,
                               Monitor& monitor)
    : channels_(3 * static_cast<int>(lighting.size())),
      floor_(static_cast<float>(floor)),
      table_(static_cast<std::size_t>(nodes) * nodes * static_cast<std::size_t>(channels_)) {
  const Shading shading(f_times_cosine, lighting);
  parallel_for(nodes, threads, [&](int row) {
    monitor.throw_if_cancelled();
    for (int column = 0; column < nodes; ++column) {
      const Place place = place_of_node(row, column);
      // The cubics of places within the rim do not reach farther.
      if (place.norm() > 1 + 2 * beside * (2.0 / steps)) continue;
      const SeenPoint point(normal_at(facing(place)));
      float* values = table_.data() + first_of_node(row, column);
      for (const Lighting& each : lighting) {
        for (const double channel : shading.value(point, each)) {
          *values++ = compressed(static_cast<float>(channel));
        }
      }
    }
  });
}

float ReflectanceMap::compressed(float value) const {
  return std::log1p(std::max(value, 0.0f) / floor_);
}

Place ReflectanceMap::place_of_node(int row, int column) {
  const auto coordinate = [](int index) { return (index - beside) * (2.0 / steps) - 1; };
  return {coordinate(column), coordinate(row)};
}

std::size_t ReflectanceMap::first_of_node(int row, int column) const {
  return static_cast<std::size_t>(row * nodes + column) * static_cast<std::size_t>(channels_);
}

void ReflectanceMap::evaluate(const Place& place, Values& values, Values& by_u,
                              Values& by_v) const {
  constexpr float per_unit = steps / 2.0f;
  const Eigen::Vector2f at = ((place.array() + 1) * (steps / 2.0)).cast<float>();
  const auto column = std::clamp(static_cast<int>(at.x()), 0, steps - 1);
  const auto row = std::clamp(static_cast<int>(at.y()), 0, steps - 1);
  const Shares across = shares_at(at.x() - static_cast<float>(column));
  const Shares along = shares_at(at.y() - static_cast<float>(row));
  values.setZero(channels_);
  by_u.setZero(channels_);
  by_v.setZero(channels_);
  for (int r = 0; r < 4; ++r) {
    for (int c = 0; c < 4; ++c) {
      const Eigen::Map<const Values> corner(
          table_.data() + first_of_node(row + beside - 1 + r, column + beside - 1 + c), channels_);
      values += across.value[c] * along.value[r] * corner;
      by_u += across.slope[c] * along.value[r] * per_unit * corner;
      by_v += across.value[c] * along.slope[r] * per_unit * corner;
    }
  }
}

}  // namespace lobefit
