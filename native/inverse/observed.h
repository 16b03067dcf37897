// What a pixel shows in all pictures, and how much each of its channels tells.
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace lobefit {

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

class Observed {
 public:
  // Values are compressed as in the reflectance map; one of `saturated` or above was at least that
  // bright. `noise` is the standard deviation of a value before that, in floors of the map.
  Observed(const float* values, int channels, float saturated, float noise)
      : values_(values, channels), saturated_(saturated) {
    // Compressed, noise is the smaller the brighter a channel is. A model is right to a per cent.
    const Eigen::ArrayXf noises = noise * (-values_.array()).exp();
    constexpr float square = Penalty::rounding * Penalty::rounding;
    weights_ = Penalty::rounding / (square + noises.square()).sqrt();
  }

  // How far a channel is off what is predicted, and the derivative of that by the latter.
  struct Misfit {
    float value, slope;
  };

  // Weighted, so that the standard deviation of noise is worth at most a per cent of brightness.
  Misfit misfit(int channel, float predicted) const {
    const float difference = values_[channel] - predicted;
    if (values_[channel] >= saturated_ && difference < 0) return {0, 0};
    return {weights_[channel] * difference, -weights_[channel]};
  }

 private:
  Eigen::Map<const Eigen::VectorXf> values_;
  Eigen::ArrayXf weights_;
  float saturated_;
};

}  // namespace lobefit
