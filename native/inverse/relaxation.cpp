#include "inverse/relaxation.h"

#include <ceres/tiny_solver.h>

#include <algorithm>
#include <array>
#include <utility>

#include "inverse/height.h"
#include "inverse/pixel_cost.h"
#include "inverse/pixelwise.h"
#include "measurement/parallel.h"

namespace lobefit {
namespace {

constexpr std::array<std::pair<int, int>, 4> around = {{{0, 1}, {0, -1}, {1, 0}, {-1, 0}}};

// What is wished of a pixel beside what it shows, and how often all of them are asked.
struct Wishes {
  // What a difference of 1 between a normal and its neighbours weighs against a difference of
  // brightness of a factor e.
  double smoothness;
  // What a difference of 1 to the normal of the mask blown up weighs along the silhouette.
  double silhouette;
  // Levels are halved down to so few pixels that what one of them shows gets around in a few
  // sweeps.
  int least_side;
  int sweeps;
};

bool on_silhouette(const Grid& grid, int row, int column) {
  return std::any_of(around.begin(), around.end(), [&](const auto& step) {
    const int r = row + step.first, c = column + step.second;
    return grid.within(r, c) && !grid.shows(r, c);
  });
}

class Relaxation {
 public:
  Relaxation(const ReflectanceMap& map, const Level& level, const Wishes& wishes,
             std::vector<Place> start)
      : map_(map), level_(level), wishes_(wishes), places_(std::move(start)) {
    for (const Place& place : places_) normals_.push_back(normal_at(place));
    if (wishes.silhouette > 0) silhouette_ = inflated_normals(level.grid);
  }

  // Takes those of other places that are better, as things stand around them.
  void consider(const std::vector<Place>& others, int threads) {
    std::vector<Place> better = places_;
    parallel_for(level_.grid.rows, threads, [&](int row) {
      for (int column = 0; column < level_.grid.columns; ++column) {
        if (!level_.grid.shows(row, column)) continue;
        const std::size_t pixel = level_.grid.at(row, column);
        const PixelCost cost = cost_of(row, column);
        if (value(cost, others[pixel]) < value(cost, places_[pixel])) better[pixel] = others[pixel];
      }
    });
    places_ = std::move(better);
    for (std::size_t i = 0; i < places_.size(); ++i) normals_[i] = normal_at(places_[i]);
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
    const std::size_t pixel = level_.grid.at(row, column);
    thread_local ceres::TinySolver<PixelCost> solver;
    solver.options.max_num_iterations = 2;
    Place place = places_[pixel];
    solver.Solve(cost_of(row, column), &place);
    places_[pixel] = facing(place);
    normals_[pixel] = normal_at(places_[pixel]);
  }

  PixelCost cost_of(int row, int column) const {
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
      prior.smooth_weight = wishes_.smoothness * neighbours;
    }
    if (wishes_.silhouette > 0 && on_silhouette(grid, row, column)) {
      prior.silhouette = silhouette_[pixel];
      prior.silhouette_weight = wishes_.silhouette;
    }
    return {map_, level_.at(pixel), prior};
  }

  static double value(const PixelCost& cost, const Place& place) {
    thread_local Eigen::VectorXd residuals;
    residuals.resize(cost.NumResiduals());
    cost(place.data(), residuals.data(), nullptr);
    return residuals.squaredNorm();
  }

  const ReflectanceMap& map_;
  const Level& level_;
  const Wishes& wishes_;
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

// The places of a level after those of all coarser ones; progress ends at `share`, and the coarser
// ones take a quarter of it.
class Relaxed {
 public:
  Relaxed(const ReflectanceMap& map, const Wishes& wishes, int threads, Monitor& monitor)
      : map_(map), wishes_(wishes), threads_(threads), monitor_(monitor) {}

  std::vector<Place> from_silhouette(const Level& level, double share) {
    std::vector<Place> start;
    if (is_coarse(level)) {
      start = inflated_places(level.grid);
    } else {
      const Level half = level.halved();
      start = spread_places(level.grid, half.grid, from_silhouette(half, share / 4));
    }
    return swept({map_, level, wishes_, std::move(start)}, share / 4, share);
  }

  std::vector<Place> from_pixels(const Level& level, double share) {
    std::vector<Place> coarse;
    if (!is_coarse(level)) {
      const Level half = level.halved();
      coarse = spread_places(level.grid, half.grid, from_pixels(half, share / 4));
    }
    const double middle = share / 2;
    std::vector<Place> own = estimate_pixelwise(map_, level, threads_, monitor_, share / 4, middle);
    Relaxation relaxation(map_, level, wishes_, coarse.empty() ? own : std::move(coarse));
    relaxation.consider(own, threads_);
    return swept(std::move(relaxation), middle, share);
  }

 private:
  bool is_coarse(const Level& level) const {
    return std::max(level.grid.rows, level.grid.columns) <= wishes_.least_side;
  }

  std::vector<Place> swept(Relaxation relaxation, double from, double to) {
    for (int i = 0; i < wishes_.sweeps; ++i) {
      monitor_.throw_if_cancelled();
      monitor_.report("normals", from + (to - from) * i / wishes_.sweeps);
      relaxation.sweep(threads_);
    }
    return relaxation.take();
  }

  const ReflectanceMap& map_;
  const Wishes& wishes_;
  int threads_;
  Monitor& monitor_;
};

}  // namespace

std::vector<Place> relaxed_from_silhouette(const ReflectanceMap& map, const Level& level,
                                           int threads, Monitor& monitor) {
  constexpr Wishes wishes{10, 10, 24, 60};
  return Relaxed(map, wishes, threads, monitor).from_silhouette(level, 1);
}

std::vector<Place> relaxed_from_pixels(const ReflectanceMap& map, const Level& level, int threads,
                                       Monitor& monitor) {
  constexpr Wishes wishes{1, 0, 32, 30};
  return Relaxed(map, wishes, threads, monitor).from_pixels(level, 1);
}

}  // namespace lobefit
