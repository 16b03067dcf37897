#include "fitting/variables.h"

#include <cmath>
#include <limits>
#include <numeric>

namespace lobefit {
namespace {

// An exponent of 1e-4 is flat to .1 % over nearly all bins, one of 1e8 narrower than a hundredth of
// the first bin; an index of 1.0001 reflects 2.5e-9 and one of 200 is a mirror: beyond these bounds
// the data cannot tell.
constexpr double min_exponent = 1e-4, max_exponent = 1e8;
constexpr double min_excess_ior = 1e-4, max_excess_ior = 199;

}  // namespace

Variables::Variables(ModelKind kind, bool fresnel, bool separate_channels, Specular specular_is)
    : kind_(kind), specular_is_(specular_is), exponents_(separate_channels ? 3 : 1) {
  int count = log_exponent + exponents_;
  if (kind == ModelKind::interpolated) interpolation_ = count++;
  if (fresnel) log_excess_ior_ = count++;
  lower_ = Eigen::VectorXd::Zero(count);
  upper_ = Eigen::VectorXd::Constant(count, std::numeric_limits<double>::max());
  lower_.segment(log_exponent, exponents_).setConstant(std::log(min_exponent));
  upper_.segment(log_exponent, exponents_).setConstant(std::log(max_exponent));
  if (interpolation_ >= 0) upper_[interpolation_] = 1;
  if (fresnel) {
    lower_[log_excess_ior_] = std::log(min_excess_ior);
    upper_[log_excess_ior_] = std::log(max_excess_ior);
  }
}

Eigen::VectorXd Variables::clamp(const Eigen::VectorXd& x) const {
  return x.cwiseMax(lower_).cwiseMin(upper_);
}

SpecularScale Variables::specular_scale(const Eigen::VectorXd& x, int channel) const {
  if (specular_is_ == Specular::peak) {
    if (log_excess_ior_ < 0) return {1, -1, 0, 0};
    // 1 / R_F = (1 + 2 / (eta - 1))^2 for light from the normal.
    const double excess = std::exp(x[log_excess_ior_]), sum = excess + 2;
    const double root = sum / excess;
    return {root * root, log_excess_ior_, -4 / sum, 4 * excess / (sum * sum)};
  }
  const int exponent = exponent_of(channel);
  const double s = std::exp(x[exponent]);
  const double factor = lobefit::specular_scale(kind_, s);
  if (kind_ == ModelKind::interpolated) return {factor, -1, 0, 0};
  const double shift = kind_ == ModelKind::modified_phong ? 2 : 8;
  return {factor, exponent, s / (s + shift), s * shift / ((s + shift) * (s + shift))};
}

std::vector<int> Variables::all() const {
  std::vector<int> indices(static_cast<std::size_t>(count()));
  std::iota(indices.begin(), indices.end(), 0);
  return indices;
}

std::vector<int> Variables::reflectances() const { return {0, 1, 2, 3, 4, 5}; }

std::vector<int> Variables::shape() const {
  std::vector<int> indices = all();
  indices.erase(indices.begin(), indices.begin() + log_exponent);
  return indices;
}

std::vector<int> Variables::shape_and_specular() const {
  std::vector<int> indices = all();
  indices.erase(indices.begin(), indices.begin() + specular);
  return indices;
}

std::vector<std::string> Variables::names() const {
  std::vector<std::string> names;
  const auto add_channels = [&](const std::string& name) {
    for (const char* channel : {" red", " green", " blue"}) names.push_back(name + channel);
  };
  add_channels("diffuse");
  add_channels("specular");
  if (exponents_ == 3) {
    add_channels("exponent");
  } else {
    names.emplace_back("exponent");
  }
  if (interpolation_ >= 0) names.emplace_back("interpolation");
  if (log_excess_ior_ >= 0) names.emplace_back("ior");
  return names;
}

double Variables::coefficient_scale(const Eigen::VectorXd& x, int channel) const {
  if (specular_is_ == Specular::coefficient) return 1;
  return specular_scale(x, channel).factor /
         lobefit::specular_scale(kind_, std::exp(x[exponent_of(channel)]));
}

Eigen::VectorXd Variables::with_coefficients(const Eigen::VectorXd& x) const {
  Eigen::VectorXd result = x;
  for (int c = 0; c < 3; ++c) result[specular + c] *= coefficient_scale(x, c);
  return result;
}

Parameters Variables::to_parameters(const Eigen::VectorXd& x, double unit) const {
  Parameters parameters;
  parameters.kind = kind_;
  parameters.diffuse = x.segment<3>(diffuse).array() * (unit * pi);
  parameters.specular = with_coefficients(x).segment<3>(specular).array() * unit;
  for (int c = 0; c < 3; ++c) parameters.exponent[c] = std::exp(x[exponent_of(c)]);
  if (interpolation_ >= 0) parameters.interpolation = x[interpolation_];
  if (log_excess_ior_ >= 0) parameters.ior = 1 + std::exp(x[log_excess_ior_]);
  return parameters;
}

Eigen::VectorXd Variables::from_parameters(const Parameters& parameters, double unit) const {
  Eigen::VectorXd x(count());
  x.segment<3>(diffuse) = parameters.diffuse / (unit * pi);
  x.segment(log_exponent, exponents_) = parameters.exponent.head(exponents_).log();
  if (interpolation_ >= 0) x[interpolation_] = parameters.interpolation;
  if (log_excess_ior_ >= 0) x[log_excess_ior_] = std::log(parameters.ior.value() - 1);
  for (int c = 0; c < 3; ++c) {
    x[specular + c] = parameters.specular[c] / unit / coefficient_scale(x, c);
  }
  return clamp(x);
}

}  // namespace lobefit
