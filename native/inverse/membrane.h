// Least squares over the pixels of a mask.
#pragma once

#include <vector>

#include "inverse/grid.h"

namespace lobefit {

// Of the heights z of a grid's pixels the sum, over pixels p beside and below each other, of
//
//   weight (z_q - z_p - rise)^2,
//
// and over all pixels of anchor z^2 - 2 load z: a membrane that springs pull at. `right` stands for
// a pixel and the one right of it, `down` for it and the one below; a spring counts where both of
// its pixels show the surface.
struct Membrane {
  struct Spring {
    double weight = 0;
    double rise = 0;
  };
  std::vector<Spring> right, down;
  std::vector<double> anchor, load;
};

// The heights at rest, by conjugate gradients from `guess`; 0 where the grid shows no surface. A
// part without an anchor keeps the mean height of its guess.
std::vector<double> rest(const Grid& grid, const Membrane& membrane,
                         const std::vector<double>& guess);

// What each pixel has of the one it lies in of the grid halved.
std::vector<double> spread(const Grid& grid, const Grid& halved, const std::vector<double>& values);

}  // namespace lobefit
