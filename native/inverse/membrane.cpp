#include "inverse/membrane.h"

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>

namespace lobefit {
namespace {

using Matrix = Eigen::SparseMatrix<double>;

// The numbers of the pixels that show the surface, -1 for the others.
std::vector<int> numbered(const Grid& grid) {
  std::vector<int> numbers(grid.size(), -1);
  int count = 0;
  for (std::size_t pixel = 0; pixel < grid.size(); ++pixel) {
    if (grid.mask[pixel]) numbers[pixel] = count++;
  }
  return numbers;
}

}  // namespace

std::vector<double> rest(const Grid& grid, const Membrane& membrane,
                         const std::vector<double>& guess) {
  const std::vector<int> numbers = numbered(grid);
  const int count = static_cast<int>(
      std::count_if(numbers.begin(), numbers.end(), [](int number) { return number >= 0; }));
  std::vector<double> heights(grid.size(), 0.0);
  if (count == 0) return heights;

  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd pull(count), start(count);
  const auto add_spring = [&](std::size_t p, std::size_t q, const Membrane::Spring& spring) {
    const int a = numbers[p], b = numbers[q];
    entries.insert(entries.end(), {{a, a, spring.weight},
                                   {b, b, spring.weight},
                                   {a, b, -spring.weight},
                                   {b, a, -spring.weight}});
    pull[a] -= spring.weight * spring.rise;
    pull[b] += spring.weight * spring.rise;
  };
  for (std::size_t pixel = 0; pixel < grid.size(); ++pixel) {
    if (numbers[pixel] < 0) continue;
    pull[numbers[pixel]] = membrane.load[pixel];
    start[numbers[pixel]] = guess[pixel];
    entries.emplace_back(numbers[pixel], numbers[pixel], membrane.anchor[pixel]);
  }
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      if (!grid.shows(row, column)) continue;
      const std::size_t pixel = grid.at(row, column);
      if (grid.shows(row, column + 1)) add_spring(pixel, pixel + 1, membrane.right[pixel]);
      if (grid.shows(row + 1, column)) {
        add_spring(pixel, grid.at(row + 1, column), membrane.down[pixel]);
      }
    }
  }
  Matrix matrix(count, count);
  matrix.setFromTriplets(entries.begin(), entries.end());

  Eigen::ConjugateGradient<Matrix, Eigen::Lower | Eigen::Upper> solver(matrix);
  solver.setTolerance(1e-6);
  const Eigen::VectorXd solved = solver.solveWithGuess(pull, start);
  for (std::size_t pixel = 0; pixel < grid.size(); ++pixel) {
    if (numbers[pixel] >= 0) heights[pixel] = solved[numbers[pixel]];
  }
  return heights;
}

std::vector<double> spread(const Grid& grid, const Grid& halved,
                           const std::vector<double>& values) {
  std::vector<double> result(grid.size());
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      result[grid.at(row, column)] = values[halved.at(row / 2, column / 2)];
    }
  }
  return result;
}

}  // namespace lobefit
