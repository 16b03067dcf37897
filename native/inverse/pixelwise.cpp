#include "inverse/pixelwise.h"

#include <ceres/tiny_solver.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "inverse/pixel_cost.h"
#include "measurement/parallel.h"

namespace lobefit {
namespace {

// Places all over the hemisphere, of which the best explain a pixel roughly.
class Lattice {
 public:
  explicit Lattice(const ReflectanceMap& map) : channels_(map.channels()) {
    ReflectanceMap::Values values, by_u, by_v;
    for (int row = 0; row < side; ++row) {
      for (int column = 0; column < side; ++column) {
        const Place place(coordinate(column), coordinate(row));
        index_[row][column] = place.norm() > rim ? -1 : static_cast<int>(places_.size());
        if (index_[row][column] < 0) continue;
        places_.push_back(place);
        map.evaluate(place, values, by_u, by_v);
        values_.insert(values_.end(), values.begin(), values.end());
      }
    }
    find_neighbours();
  }

  // Up to `most` places from which to look further, the best first: those that no neighbour beats.
  std::vector<Place> starts(const Observed& observed, std::size_t most) const {
    thread_local std::vector<float> penalties;
    penalties.resize(places_.size());
    for (std::size_t i = 0; i < places_.size(); ++i) {
      penalties[i] = penalty(values_.data() + i * static_cast<std::size_t>(channels_), observed);
    }
    std::vector<std::size_t> best;
    for (std::size_t i = 0; i < places_.size(); ++i) {
      const bool beaten =
          std::any_of(neighbours_[i].begin(), neighbours_[i].end(), [&](int neighbour) {
            return neighbour >= 0 && penalties[static_cast<std::size_t>(neighbour)] < penalties[i];
          });
      if (!beaten) best.push_back(i);
    }
    const auto kept = best.begin() + static_cast<std::ptrdiff_t>(std::min(most, best.size()));
    std::partial_sort(best.begin(), kept, best.end(), [&](std::size_t a, std::size_t b) {
      return penalties[a] < penalties[b] || (penalties[a] == penalties[b] && a < b);
    });
    std::vector<Place> places;
    std::transform(best.begin(), kept, std::back_inserter(places),
                   [&](std::size_t i) { return places_[i]; });
    return places;
  }

 private:
  // Steps of 7 degrees in the middle and 4 at the rim.
  static constexpr int middle = 16, side = 2 * middle + 1;
  static double coordinate(int i) { return (i - middle) * (1.0 / middle); }

  float penalty(const float* predicted, const Observed& observed) const {
    float sum = 0;
    for (int c = 0; c < channels_; ++c) sum += Penalty::of(observed.misfit(c, predicted[c]).value);
    return sum;
  }

  void find_neighbours() {
    neighbours_.resize(places_.size());
    for (int row = 0; row < side; ++row) {
      for (int column = 0; column < side; ++column) {
        if (index_[row][column] < 0) continue;
        auto& neighbours = neighbours_[static_cast<std::size_t>(index_[row][column])];
        neighbours.fill(-1);
        int count = 0;
        for (int r = std::max(row - 1, 0); r <= std::min(row + 1, side - 1); ++r) {
          for (int c = std::max(column - 1, 0); c <= std::min(column + 1, side - 1); ++c) {
            if (r != row || c != column) neighbours[count++] = index_[r][c];
          }
        }
      }
    }
  }

  int channels_;
  std::array<std::array<int, side>, side> index_;
  std::vector<Place> places_;
  std::vector<float> values_;
  std::vector<std::array<int, 8>> neighbours_;
};

constexpr std::size_t most_starts = 3;
// A mean penalty of so little, a per cent of brightness, is as good as explained.
constexpr double explained = 0.01;

Place best_place(const ReflectanceMap& map, const Lattice& lattice, const Observed& observed) {
  const PixelCost cost(map, observed);
  thread_local ceres::TinySolver<PixelCost> solver;
  solver.options.max_num_iterations = 20;
  Place best = Place::Zero();
  double least = std::numeric_limits<double>::max();
  for (Place place : lattice.starts(observed, most_starts)) {
    const double penalty = solver.Solve(cost, &place).final_cost;
    if (penalty < least) {
      least = penalty;
      best = facing(place);
    }
    if (least < explained) break;
  }
  return best;
}

}  // namespace

std::vector<Place> estimate_pixelwise(const ReflectanceMap& map, const Level& level, int threads,
                                      Monitor& monitor, double from, double to) {
  const Lattice lattice(map);
  std::vector<Place> places(level.grid.size(), Place::Zero());
  std::atomic<int> done = 0;
  parallel_for(level.grid.rows, threads, [&](int row) {
    monitor.throw_if_cancelled();
    for (int column = 0; column < level.grid.columns; ++column) {
      const std::size_t pixel = level.grid.at(row, column);
      if (!level.grid.mask[pixel]) continue;
      places[pixel] = best_place(map, lattice, level.at(pixel));
    }
    monitor.report("normals", from + (to - from) * ++done / level.grid.rows);
  });
  return places;
}

}  // namespace lobefit
