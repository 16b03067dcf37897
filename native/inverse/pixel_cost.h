// How well a normal explains a pixel, as Ceres' TinySolver minimises it.
#pragma once

#include <Eigen/Core>
#include <utility>

#include "inverse/observed.h"
#include "inverse/reflectance_map.h"
#include "inverse/stereographic.h"

namespace lobefit {

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

  PixelCost(const ReflectanceMap& map, Observed observed, const Prior& prior = {})
      : map_(map), observed_(std::move(observed)), prior_(prior) {}

  int NumResiduals() const { return map_.channels() + 5; }
  bool operator()(const double* place, double* residuals, double* jacobian) const;

 private:
  const ReflectanceMap& map_;
  Observed observed_;
  Prior prior_;
};

}  // namespace lobefit
