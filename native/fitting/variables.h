// The variables that a fit moves, and what they mean.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "fitting/options.h"

namespace lobefit {

// Order: rho_d/pi of r, g, b; specular of r, g, b; log s (one, or one a channel); alpha (of the
// interpolated model alone); log(eta - 1) (with Fresnel alone). Reflectances are in units of the
// median; log s and log(eta - 1) because s and eta range over decades.
class Variables {
 public:
  static constexpr int diffuse = 0;
  static constexpr int specular = 3;
  static constexpr int log_exponent = 6;

  Variables(ModelKind kind, bool fresnel, bool separate_channels);

  ModelKind kind() const { return kind_; }
  int exponents() const { return exponents_; }
  int interpolation() const { return interpolation_; }    // -1 where the model has none
  int log_excess_ior() const { return log_excess_ior_; }  // -1 without Fresnel
  int count() const { return static_cast<int>(lower_.size()); }

  const Eigen::VectorXd& lower() const { return lower_; }
  const Eigen::VectorXd& upper() const { return upper_; }
  Eigen::VectorXd clamp(const Eigen::VectorXd& x) const;

  // All variables, and those of the paper's stages.
  std::vector<int> all() const;
  std::vector<int> reflectances() const;        // stage (i)
  std::vector<int> shape() const;               // stage (ii)
  std::vector<int> shape_and_specular() const;  // stage (iii)

  // "diffuse red", .., "specular red", .., "exponent" (or "exponent red", ..), "interpolation",
  // "ior".
  std::vector<std::string> names() const;

  // `unit` is the median reflectance in 1/sr.
  Parameters to_parameters(const Eigen::VectorXd& x, double unit) const;
  // Its inverse, within the bounds.
  Eigen::VectorXd from_parameters(const Parameters& parameters, double unit) const;

 private:
  ModelKind kind_;
  int exponents_;
  int interpolation_ = -1;
  int log_excess_ior_ = -1;
  Eigen::VectorXd lower_, upper_;
};

}  // namespace lobefit
