#include "inverse/height.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "inverse/membrane.h"

namespace lobefit {
namespace {

// Below so many pixels a guess for the whole is not needed.
constexpr std::size_t few = 4096;
// Steeper slopes, beyond 84 degrees, are taken for this one: of a height in pixels they tell no
// more.
constexpr double least_cosine = 0.1;

std::vector<Vector3> halved_normals(const Grid& grid, const Grid& half,
                                    const std::vector<Vector3>& normals) {
  std::vector<Vector3> sums(half.size(), Vector3::Zero());
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      if (grid.shows(row, column)) {
        sums[half.at(row / 2, column / 2)] += normals[grid.at(row, column)];
      }
    }
  }
  for (Vector3& sum : sums) sum.normalize();
  return sums;
}

// From one pixel to the next, `along` being the part of the normals in that direction.
Membrane::Spring spring_between(const Vector3& a, const Vector3& b, const Vector3& along) {
  const Vector3 sum = (a + b).normalized();
  const double cosine = std::max(sum.z(), least_cosine);
  return {square(cosine), -sum.dot(along) / cosine};
}

std::vector<double> heights_of(const Grid& grid, const std::vector<Vector3>& normals) {
  std::vector<double> guess(grid.size(), 0.0);
  if (grid.size() > few) {
    const Grid half = grid.halved();
    guess = spread(grid, half, heights_of(half, halved_normals(grid, half, normals)));
    for (double& height : guess) height *= 2;
  }
  Membrane membrane{
      {}, {}, std::vector<double>(grid.size(), 0.0), std::vector<double>(grid.size(), 0.0)};
  membrane.right.resize(grid.size());
  membrane.down.resize(grid.size());
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      if (!grid.shows(row, column)) continue;
      const std::size_t p = grid.at(row, column);
      if (grid.shows(row, column + 1)) {
        membrane.right[p] = spring_between(normals[p], normals[p + 1], Vector3::UnitX());
      }
      if (grid.shows(row + 1, column)) {
        const Vector3& below = normals[grid.at(row + 1, column)];
        membrane.down[p] = spring_between(normals[p], below, -Vector3::UnitY());
      }
    }
  }
  return rest(grid, membrane, guess);
}

// Puts the lowest point of every connected part of the mask at 0.
void settle(const Grid& grid, std::vector<double>& heights) {
  std::vector<std::uint8_t> seen(grid.size(), 0);
  std::vector<std::size_t> part;
  const auto visit = [&](int row, int column) {
    if (!grid.shows(row, column) || seen[grid.at(row, column)]) return;
    seen[grid.at(row, column)] = 1;
    part.push_back(grid.at(row, column));
  };
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      part.clear();
      visit(row, column);
      double lowest = std::numeric_limits<double>::max();
      for (std::size_t next = 0; next < part.size(); ++next) {
        const auto width = static_cast<std::size_t>(grid.columns);
        const int r = static_cast<int>(part[next] / width),
                  c = static_cast<int>(part[next] % width);
        lowest = std::min(lowest, heights[part[next]]);
        visit(r, c + 1), visit(r, c - 1), visit(r + 1, c), visit(r - 1, c);
      }
      for (const std::size_t pixel : part) heights[pixel] -= lowest;
    }
  }
}

// The squares of the heights of the mask blown up.
std::vector<double> inflated_squares(const Grid& grid) {
  std::vector<double> guess(grid.size(), 0.0);
  if (grid.size() > few) {
    const Grid half = grid.halved();
    guess = spread(grid, half, inflated_squares(half));
    for (double& height : guess) height *= 4;
  }
  // Where no silhouette holds a part down, the picture cuts all of it, the anchor leaves it flat.
  Membrane membrane{
      {}, {}, std::vector<double>(grid.size(), 1e-8), std::vector<double>(grid.size(), 4.0)};
  membrane.right.assign(grid.size(), {1, 0});
  membrane.down.assign(grid.size(), {1, 0});
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      for (const auto& [r, c] : {std::pair(row, column + 1), std::pair(row, column - 1),
                                 std::pair(row + 1, column), std::pair(row - 1, column)}) {
        // The silhouette runs half-way to a pixel beside it.
        if (grid.within(r, c) && !grid.shows(r, c)) membrane.anchor[grid.at(row, column)] += 2;
      }
    }
  }
  return rest(grid, membrane, guess);
}

}  // namespace

std::vector<double> integrate_normals(const Grid& grid, const std::vector<Vector3>& normals) {
  std::vector<double> heights = heights_of(grid, normals);
  settle(grid, heights);
  return heights;
}

std::vector<Vector3> inflated_normals(const Grid& grid) {
  const std::vector<double> squares = inflated_squares(grid);
  std::vector<Vector3> normals(grid.size(), Vector3::UnitZ());
  // The slope between two pixels; toward a silhouette that to its 0 half a pixel away.
  const auto slope = [&](int row, int column, int down, int right) {
    const double here = squares[grid.at(row, column)];
    const auto step = [&](int r, int c) {
      if (!grid.within(r, c)) return 0.0;
      return grid.shows(r, c) ? squares[grid.at(r, c)] - here : -2 * here;
    };
    return (step(row + down, column + right) - step(row - down, column - right)) / 2;
  };
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      if (!grid.shows(row, column)) continue;
      const std::size_t pixel = grid.at(row, column);
      const double height = std::sqrt(std::max(squares[pixel], 0.0));
      normals[pixel] =
          Vector3(-slope(row, column, 0, 1) / 2, slope(row, column, 1, 0) / 2, height).normalized();
    }
  }
  return normals;
}

}  // namespace lobefit
