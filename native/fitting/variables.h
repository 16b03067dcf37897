// The variables that a fit moves, and what they mean.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "fitting/options.h"

namespace lobefit {

// What the specular variables of a fit are.
enum class Specular {
  coefficient,  // rho_s or k_s of the model, which the paper's stages hold while the shape moves
  // k_s R_F of light from the normal, the highest value of the lobe away from grazing angles. As
  // eta nears 1 the data determine only k_s (eta - 1)^2, a long bent valley for k_s and eta and a
  // straight one here; and rho_s changes with every s that leaves the peak alone.
  peak,
};

// k_s of a specular variable of 1. Its logarithm changes with one other variable at most, `by` (-1
// where with none), with this slope and curvature.
struct SpecularScale {
  double factor;
  int by;
  double log_slope, log_curvature;
};

// Order: rho_d/pi of r, g, b; specular of r, g, b; log s (one, or one a channel); alpha (of the
// interpolated model alone); log(eta - 1) (with Fresnel alone). Reflectances are in units of the
// median; log s and log(eta - 1) because s and eta range over decades.
class Variables {
 public:
  static constexpr int diffuse = 0;
  static constexpr int specular = 3;
  static constexpr int log_exponent = 6;

  Variables(ModelKind kind, bool fresnel, bool separate_channels,
            Specular specular_is = Specular::coefficient);

  ModelKind kind() const { return kind_; }
  int exponents() const { return exponents_; }
  int interpolation() const { return interpolation_; }    // -1 where the model has none
  int log_excess_ior() const { return log_excess_ior_; }  // -1 without Fresnel
  int count() const { return static_cast<int>(lower_.size()); }

  const Eigen::VectorXd& lower() const { return lower_; }
  const Eigen::VectorXd& upper() const { return upper_; }
  Eigen::VectorXd clamp(const Eigen::VectorXd& x) const;

  // Of a channel's specular variable at x.
  SpecularScale specular_scale(const Eigen::VectorXd& x, int channel) const;

  // All variables, and those of the paper's stages.
  std::vector<int> all() const;
  std::vector<int> reflectances() const;        // stage (i)
  std::vector<int> shape() const;               // stage (ii)
  std::vector<int> shape_and_specular() const;  // stage (iii)

  // "diffuse red", .., "specular red", .., "exponent" (or "exponent red", ..), "interpolation",
  // "ior".
  std::vector<std::string> names() const;

  // x with rho_s or k_s in place of its specular variables.
  Eigen::VectorXd with_coefficients(const Eigen::VectorXd& x) const;

  // `unit` is the median reflectance in 1/sr.
  Parameters to_parameters(const Eigen::VectorXd& x, double unit) const;
  // Its inverse, within the bounds.
  Eigen::VectorXd from_parameters(const Parameters& parameters, double unit) const;

 private:
  // rho_s or k_s of a channel's specular variable of 1.
  double coefficient_scale(const Eigen::VectorXd& x, int channel) const;
  int exponent_of(int channel) const { return log_exponent + (exponents_ == 3 ? channel : 0); }

  ModelKind kind_;
  Specular specular_is_;
  int exponents_;
  int interpolation_ = -1;
  int log_excess_ior_ = -1;
  Eigen::VectorXd lower_, upper_;
};

}  // namespace lobefit
