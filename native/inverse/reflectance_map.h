// What a pixel shows, by its normal.
#pragma once

#include <cstddef>
#include <vector>

#include "fitting/monitor.h"
#include "inverse/lighting.h"
#include "inverse/stereographic.h"
#include "reflectance/reflectance.h"

namespace lobefit {

// The reflectance map (Horn 1977) of each of some pictures in one table over the stereographic
// plane: with far lights and a far camera a pixel's value depends on its normal alone.
//
// Values are compressed, x -> ln(1 + x / floor). Ratios of what is brighter than `floor` become
// differences, as errors of a model, exposures and the noise of photons are proportional to it;
// what is darker, where noise rules, hardly counts; and highlights, which fall off as Gaussians or
// powers, become parabolas, wide to find and easy to interpolate.
class ReflectanceMap {
 public:
  // Three channels of a picture follow those of the one before it.
  using Values = Eigen::VectorXf;

  // f_times_cosine is called from several threads; where it is NaN the surface is taken for black.
  ReflectanceMap(const Reflectance& f_times_cosine, const std::vector<Lighting>& lighting,
                 double floor, int threads, Monitor& monitor);

  int channels() const { return channels_; }
  float floor() const { return floor_; }
  float compressed(float value) const;

  // The values at a place within the unit circle, and their derivatives by u and v.
  void evaluate(const Place& place, Values& values, Values& by_u, Values& by_v) const;

 private:
  // Across the unit circle; one step is .4 degrees of the normal in the middle and .2 at the rim.
  static constexpr int steps = 512;
  // Nodes beside the unit circle, which cubic interpolation looks at.
  static constexpr int beside = 2;
  static constexpr int nodes = steps + 1 + 2 * beside;

  static Place place_of_node(int row, int column);
  std::size_t first_of_node(int row, int column) const;

  int channels_;
  float floor_;
  std::vector<float> table_;
};

}  // namespace lobefit
