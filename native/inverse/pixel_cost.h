// How well a normal explains a pixel, as Ceres' TinySolver minimises it.
#pragma once

#include <Eigen/Core>

#include "inverse/reflectance_map.h"
#include "inverse/stereographic.h"

namespace lobefit {

// What a pixel shows in all pictures, compressed as in the reflectance map.
using Observed = Eigen::Map<const Eigen::VectorXf>;

// The penalty of one channel for r = observed - predicted, both compressed: L1, so that few
// channels which the model does not explain, such as highlights that it shapes badly, do not bend
// the others. What is darker than it should be may lie in another part's shadow: its penalty stays
// below `darkness`. With a limit of 1 normals that turn away from two of six lights, for the sake
// of shadows cast there, win over the true ones.
struct Penalty {
  // |r| is rounded off below a per cent of brightness, so that derivatives exist.
  static constexpr float rounding = 0.01f;
  static constexpr float darkness = 0.25f;

  static float of(float r) {
    const float size = std::sqrt(r * r + rounding * rounding) - rounding;
    return r < 0 ? size / (1 + size / darkness) : size;
  }
};

// Wishes of the surroundings; each adds weight |n - normal|^2 / 2 over the components it concerns.
struct Prior {
  Vector3 smooth = Vector3::Zero();  // the neighbours' mean; x and y count
  double smooth_weight = 0;
  Vector3 silhouette = Vector3::Zero();
  double silhouette_weight = 0;
};

// A function of a place in the stereographic plane. The squares of its residuals add up to twice
// the mean penalty of a pixel's channels and to what the prior adds.
class PixelCost {
 public:
  using Scalar = double;
  enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = 2 };

  // A channel observed at `saturated` or above was at least that bright.
  PixelCost(const ReflectanceMap& map, float saturated, const float* observed,
            const Prior& prior = {})
      : map_(map), saturated_(saturated), observed_(observed, map.channels()), prior_(prior) {}

  int NumResiduals() const { return map_.channels() + 5; }
  bool operator()(const double* place, double* residuals, double* jacobian) const;

 private:
  const ReflectanceMap& map_;
  float saturated_;
  Observed observed_;
  Prior prior_;
};

}  // namespace lobefit
