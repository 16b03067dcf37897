// The pixels of a picture that show the surface.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace lobefit {

// mask is not 0 for a pixel that shows it; row by row from the top.
struct Grid {
  int rows = 0, columns = 0;
  std::vector<std::uint8_t> mask;

  std::size_t size() const { return mask.size(); }
  std::size_t at(int row, int column) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
           static_cast<std::size_t>(column);
  }
  bool within(int row, int column) const {
    return row >= 0 && row < rows && column >= 0 && column < columns;
  }
  bool shows(int row, int column) const {
    return within(row, column) && mask[at(row, column)] != 0;
  }

  // The grid of pixels twice as wide; one of them shows the surface if any of its four does.
  Grid halved() const {
    Grid half{(rows + 1) / 2, (columns + 1) / 2, {}};
    half.mask.assign(static_cast<std::size_t>(half.rows) * static_cast<std::size_t>(half.columns),
                     0);
    for (int row = 0; row < rows; ++row) {
      for (int column = 0; column < columns; ++column) {
        if (shows(row, column)) half.mask[half.at(row / 2, column / 2)] = 1;
      }
    }
    return half;
  }
};

}  // namespace lobefit
