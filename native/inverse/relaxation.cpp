#include "inverse/relaxation.h"

#include <ceres/tiny_solver.h>

#include <algorithm>
#include <array>
#include <utility>

#include "inverse/height.h"
#include "inverse/pixel_cost.h"
#include "measurement/parallel.h"

namespace lobefit {
namespace {

constexpr std::array<std::pair<int, int>, 4> around = {{{0, 1}, {0, -1}, {1, 0}, {-1, 0}}};

// Levels are halved down to so few pixels that what one of them shows gets around in a few sweeps.
constexpr int least_side = 24;
// Of each level.
constexpr int sweeps = 60;
// What a difference of 1 between a normal and its neighbours weighs against a difference of
// brightness of a factor e.
constexpr double smoothness = 10;
// What a difference of 1 to the normal of the mask blown up weighs along the silhouette.
constexpr double silhouette_weight = 10;

bool on_silhouette(const Grid& grid, int row, int column) {
  return std::any_of(around.begin(), around.end(), [&](const auto& step) {
    const int r = row + step.first, c = column + step.second;
    return grid.within(r, c) && !grid.shows(r, c);
  });
}

class Relaxation {
 public:
  Relaxation(const ReflectanceMap& map, const Level& level, std::vector<Place> start)
      : map_(map), level_(level), places_(std::move(start)) {
    for (const Place& place : places_) normals_.push_back(normal_at(place));
    silhouette_ = inflated_normals(level.grid);
  }

  void sweep(int threads) {
    const Grid& grid = level_.grid;
    for (int colour = 0; colour < 4; ++colour) {
      parallel_for((grid.rows + 1) / 2, threads, [&](int pair) {
        const int row = 2 * pair + colour / 2;
        for (int column = colour % 2; column < grid.columns; column += 2) {
          if (grid.shows(row, column)) move(row, column);
        }
      });
    }
  }

  std::vector<Place> take() { return std::move(places_); }

 private:
  void move(int row, int column) {
    const Grid& grid = level_.grid;
    const std::size_t pixel = grid.at(row, column);
    Prior prior;
    int neighbours = 0;
    for (const auto& [down, right] : around) {
      if (!grid.shows(row + down, column + right)) continue;
      prior.smooth += normals_[grid.at(row + down, column + right)];
      ++neighbours;
    }
    if (neighbours > 0) {
      prior.smooth /= neighbours;
      prior.smooth_weight = smoothness * neighbours;
    }
    if (on_silhouette(grid, row, column)) {
      prior.silhouette = silhouette_[pixel];
      prior.silhouette_weight = silhouette_weight;
    }
    const PixelCost cost(map_, level_.saturated, level_.at(pixel), prior);
    thread_local ceres::TinySolver<PixelCost> solver;
    solver.options.max_num_iterations = 2;
    Place place = places_[pixel];
    solver.Solve(cost, &place);
    places_[pixel] = facing(place);
    normals_[pixel] = normal_at(places_[pixel]);
  }

  const ReflectanceMap& map_;
  const Level& level_;
  std::vector<Place> places_;
  std::vector<Vector3> normals_, silhouette_;
};

// Places of the pixels that each pixel lies in of a grid halved.
std::vector<Place> spread_places(const Grid& grid, const Grid& half,
                                 const std::vector<Place>& places) {
  std::vector<Place> result(grid.size());
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      result[grid.at(row, column)] = places[half.at(row / 2, column / 2)];
    }
  }
  return result;
}

std::vector<Place> inflated_places(const Grid& grid) {
  std::vector<Place> places;
  for (const Vector3& normal : inflated_normals(grid)) places.push_back(facing(place_of(normal)));
  return places;
}

// A level after all that are coarser, which take a quarter of the time; progress ends at `share`.
std::vector<Place> relaxed(const ReflectanceMap& map, const Level& level, int threads, double share,
                           Monitor& monitor) {
  std::vector<Place> start;
  if (std::max(level.grid.rows, level.grid.columns) > least_side) {
    const Level half = level.halved();
    start = spread_places(level.grid, half.grid, relaxed(map, half, threads, share / 4, monitor));
  } else {
    start = inflated_places(level.grid);
  }
  Relaxation relaxation(map, level, std::move(start));
  for (int i = 0; i < sweeps; ++i) {
    monitor.throw_if_cancelled();
    monitor.report("normals", share * (0.25 + 0.75 * i / sweeps));
    relaxation.sweep(threads);
  }
  return relaxation.take();
}

}  // namespace

std::vector<Place> estimate_jointly(const ReflectanceMap& map, const Level& level, int threads,
                                    Monitor& monitor) {
  return relaxed(map, level, threads, 1, monitor);
}

}  // namespace lobefit
