#include "measurement/measurement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

namespace lobefit {
namespace {

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();

struct Trigonometry {
  std::array<double, Measurement::theta_h_bins> cos_h, sin_h;
  std::array<double, Measurement::theta_d_bins> cos_d, sin_d;
  std::array<double, Measurement::phi_d_bins> cos_phi;
};

Trigonometry trigonometry_of_centres() {
  Trigonometry t;
  for (int h = 0; h < Measurement::theta_h_bins; ++h) {
    const double angle = Measurement::centre(h, 0, 0).theta_h;
    t.cos_h[h] = std::cos(angle);
    t.sin_h[h] = std::sin(angle);
  }
  for (int d = 0; d < Measurement::theta_d_bins; ++d) {
    const double angle = Measurement::centre(0, d, 0).theta_d;
    t.cos_d[d] = std::cos(angle);
    t.sin_d[d] = std::sin(angle);
  }
  for (int p = 0; p < Measurement::phi_d_bins; ++p) {
    t.cos_phi[p] = std::cos(Measurement::centre(0, 0, p).phi_d);
  }
  return t;
}

// The two grid points around a coordinate and the share of the upper one.
struct Neighbours {
  std::array<int, 2> at;
  double share;
};

Neighbours neighbours(double coordinate, int bins) {
  const double inside = std::clamp(coordinate, 0.0, static_cast<double>(bins - 1));
  const int below = std::min(static_cast<int>(inside), bins - 2);
  return {{below, below + 1}, inside - below};
}

Neighbours periodic_neighbours(double coordinate, int bins) {
  const double below = std::floor(coordinate);
  const int first = (static_cast<int>(below) + bins) % bins;
  return {{first, (first + 1) % bins}, coordinate - below};
}

}  // namespace

Measurement::Measurement(std::vector<double> planes) : planes_(std::move(planes)) {
  if (planes_.size() != 3 * static_cast<std::size_t>(bin_count)) {
    throw std::invalid_argument("a measurement has three planes of 90 x 90 x 180 values");
  }
  const Trigonometry t = trigonometry_of_centres();
  double* const red = planes_.data();
  double* const green = red + bin_count;
  double* const blue = green + bin_count;
  for (int h = 0; h < theta_h_bins; ++h) {
    for (int d = 0; d < theta_d_bins; ++d) {
      const double along = t.cos_h[h] * t.cos_d[d];
      const double across = t.sin_h[h] * t.sin_d[d];
      for (int p = 0; p < phi_d_bins; ++p) {
        const int i = index(h, d, p);
        int* reason = &bins_.valid;
        if (along <= across * std::abs(t.cos_phi[p])) {
          reason = &bins_.below_horizon;
        } else if (!(std::isfinite(red[i]) && std::isfinite(green[i]) && std::isfinite(blue[i]))) {
          reason = &bins_.non_finite;
        } else if (red[i] < 0 || green[i] < 0 || blue[i] < 0) {
          reason = &bins_.negative;
        }
        ++*reason;
        if (reason != &bins_.valid) red[i] = green[i] = blue[i] = nan_value;
      }
    }
  }
}

Measurement Measurement::tabulate(const std::function<Rgb(const HalfDifference&)>& reflectance) {
  std::vector<double> planes(3 * static_cast<std::size_t>(bin_count));
  for (int i = 0; i < bin_count; ++i) {
    const int p = i % phi_d_bins, row = i / phi_d_bins;
    const Rgb value = reflectance(centre(row / theta_d_bins, row % theta_d_bins, p));
    for (int c = 0; c < 3; ++c) planes[i + c * bin_count] = value[c];
  }
  return Measurement(std::move(planes));
}

HalfDifference Measurement::centre(int h, int d, int p) {
  const double root = (h + 0.5) / theta_h_bins;
  return {root * root * (pi / 2), radians(d + 0.5), radians(p + 0.5)};
}

Rgb Measurement::bin(int h, int d, int p) const {
  const double* value = planes_.data() + index(h, d, p);
  return {value[0], value[bin_count], value[2 * bin_count]};
}

bool Measurement::valid(int h, int d, int p) const { return !std::isnan(planes_[index(h, d, p)]); }

Rgb Measurement::evaluate(const Vector3& wi, const Vector3& wo) const {
  if (!(wi.z() > 0 && wo.z() > 0)) return Rgb::Constant(nan_value);
  const HalfDifference point = to_half_difference(wi, wo);
  const Neighbours h =
      neighbours(std::sqrt(degrees(point.theta_h) * theta_h_bins) - 0.5, theta_h_bins);
  const Neighbours d = neighbours(degrees(point.theta_d) - 0.5, theta_d_bins);
  const Neighbours p = periodic_neighbours(degrees(point.phi_d) - 0.5, phi_d_bins);
  Rgb total = Rgb::Zero();
  double weight = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int a = corner & 1, b = corner >> 1 & 1, c = corner >> 2;
    const Rgb value = bin(h.at[a], d.at[b], p.at[c]);
    if (std::isnan(value[0])) continue;
    const double w =
        (a ? h.share : 1 - h.share) * (b ? d.share : 1 - d.share) * (c ? p.share : 1 - p.share);
    total += w * value;
    weight += w;
  }
  return weight > 0.5 ? Rgb(total / weight) : Rgb::Constant(nan_value);
}

}  // namespace lobefit
