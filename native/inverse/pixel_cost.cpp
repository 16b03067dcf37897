#include "inverse/pixel_cost.h"

#include <cmath>

namespace lobefit {
namespace {

// The square root of twice a penalty with the sign of r, as squares are what is summed, and its
// derivative by r.
struct Root {
  double value, slope;
};

Root root_of(double r) {
  constexpr double rounding = Penalty::rounding;
  const double length = std::sqrt(r * r + rounding * rounding);
  const double size = r * r / (length + rounding);  // length - rounding, without cancellation
  const double limit = r < 0 ? 1 + size / Penalty::darkness : 1;
  const double penalty = size / limit;
  // Near 0 the penalty is r^2 / (2 rounding).
  if (!(penalty > 0)) return {0, 1 / std::sqrt(rounding)};
  const double value = std::copysign(std::sqrt(2 * penalty), r);
  return {value, r / (length * limit * limit * value)};
}

}  // namespace

bool PixelCost::operator()(const double* at, double* residuals, double* jacobian) const {
  const Place place(at[0], at[1]), seen = facing(place);
  thread_local ReflectanceMap::Values predicted, by_u, by_v;
  map_.evaluate(seen, predicted, by_u, by_v);
  const int channels = map_.channels(), count = NumResiduals();
  Eigen::Map<Eigen::VectorXd> rest(residuals, count);
  Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, 2>> slopes(jacobian, jacobian ? count : 0, 2);

  const double share = std::sqrt(1.0 / channels);
  for (int c = 0; c < channels; ++c) {
    const Observed::Misfit misfit = observed_.misfit(c, predicted[c]);
    const Root root = root_of(misfit.value);
    rest[c] = share * root.value;
    const double slope = share * root.slope * misfit.slope;
    if (jacobian) slopes.row(c) << slope * by_u[c], slope * by_v[c];
  }

  const Vector3 normal = normal_at(seen);
  const double smooth = std::sqrt(prior_.smooth_weight);
  const double silhouette = std::sqrt(prior_.silhouette_weight);
  rest.segment<2>(channels) = smooth * (normal - prior_.smooth).head<2>();
  rest.segment<3>(channels + 2) = silhouette * (normal - prior_.silhouette);
  if (jacobian) {
    const NormalSlopes turning = normal_slopes(seen);
    slopes.middleRows<2>(channels) = smooth * turning.topRows<2>();
    slopes.middleRows<3>(channels + 2) = silhouette * turning;
  }
  return true;
}

}  // namespace lobefit
