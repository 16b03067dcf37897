// The albedo of a rough dielectric coat as Cycles tabulates it.
#pragma once

#include <array>
#include <cstddef>

namespace lobefit {

// How far the albedo of a rough dielectric toward the viewer has gone from its F0 (0) to 1 (1):
// the mean of (F - F0) / (1 - F0) over the visible GGX normals, those that reflect below the
// horizon counting 0. Cycles reads it from a table with 16 nodes each in roughness, n.wo and
// sqrt((ior - 1) / (ior + 1)), linear between them (the last node holding what belongs to .99);
// the interpolation shows, so the same nodes are computed here.
class CoatTable {
 public:
  static constexpr int nodes = 16;

  struct Share {
    double value, by_roughness, by_root_ior;
  };

  // The one table there is; computed by quadrature when first asked for.
  static const CoatTable& instance();

  // All three in [0, 1].
  Share operator()(double roughness, double n_wo, double root_ior) const;

 private:
  CoatTable();
  double node(std::ptrdiff_t roughness, int n_wo, int root_ior) const {
    return values_[static_cast<std::size_t>((roughness * nodes + n_wo) * nodes + root_ior)];
  }
  std::array<float, std::size_t{nodes} * nodes * nodes> values_;
};

}  // namespace lobefit
