#include "measurement/measurement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "measurement/large_pages.h"
#include "measurement/parallel.h"

namespace lobefit {
namespace {

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();

BinCentres make_bin_centres() {
  BinCentres t;
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

// Makes invalid bins of the h-th theta_h NaN, and counts.
BinCounts sift(int h, const Measurement::Rows& rows) {
  const BinCentres& t = bin_centres();
  BinCounts counts;
  for (int d = 0; d < Measurement::theta_d_bins; ++d) {
    const double along = t.cos_h[h] * t.cos_d[d], across = t.sin_h[h] * t.sin_d[d];
    double* const red = rows[0] + Measurement::index(0, d, 0);
    double* const green = rows[1] + Measurement::index(0, d, 0);
    double* const blue = rows[2] + Measurement::index(0, d, 0);
    for (int p = 0; p < Measurement::phi_d_bins; ++p) {
      const bool below = along <= across * std::abs(t.cos_phi[p]);
      const bool finite =
          std::isfinite(red[p]) && std::isfinite(green[p]) && std::isfinite(blue[p]);
      const bool negative = red[p] < 0 || green[p] < 0 || blue[p] < 0;
      const bool valid = !below && finite && !negative;
      counts.below_horizon += below;
      counts.non_finite += !below && !finite;
      counts.negative += !below && finite && negative;
      counts.valid += valid;
      red[p] = valid ? red[p] : nan_value;
      green[p] = valid ? green[p] : nan_value;
      blue[p] = valid ? blue[p] : nan_value;
    }
  }
  return counts;
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

Measurement::Measurement(const FillRows& fill, int threads, TableSource source)
    : planes_(std::make_unique_for_overwrite<double[]>(3 * static_cast<std::size_t>(bin_count))),
      source_(std::move(source)) {
  ask_for_large_pages(planes_.get(), 3 * static_cast<std::size_t>(bin_count) * sizeof(double));
  std::array<BinCounts, theta_h_bins> counts;
  parallel_for(theta_h_bins, thread_count(threads), [&](int h) {
    double* const first = planes_.get() + index(h, 0, 0);
    const Rows rows = {first, first + bin_count, first + 2 * bin_count};
    fill(h, rows);
    counts[static_cast<std::size_t>(h)] = sift(h, rows);
  });
  for (const BinCounts& each : counts) {
    bins_.valid += each.valid;
    bins_.below_horizon += each.below_horizon;
    bins_.negative += each.negative;
    bins_.non_finite += each.non_finite;
  }
}

Measurement::Measurement(std::span<const double> planes)
    : Measurement(
          [planes](int h, const Rows& rows) {
            if (planes.size() != 3 * static_cast<std::size_t>(bin_count)) {
              throw std::invalid_argument("a measurement has three planes of 90 x 90 x 180 values");
            }
            for (int c = 0; c < 3; ++c) {
              const auto from = planes.begin() + index(h, 0, 0) + c * bin_count;
              std::copy(from, from + row_size, rows[static_cast<std::size_t>(c)]);
            }
          },
          1) {}

Measurement Measurement::tabulate(const std::function<Rgb(const HalfDifference&)>& reflectance) {
  return Measurement(
      [&](int h, const Rows& rows) {
        for (int i = 0; i < row_size; ++i) {
          const Rgb value = reflectance(centre(h, i / phi_d_bins, i % phi_d_bins));
          for (int c = 0; c < 3; ++c) rows[static_cast<std::size_t>(c)][i] = value[c];
        }
      },
      1);
}

double BinCentres::solid_angle(int h, int d) const {
  return sin_h[h] * (h + 0.5) * sin_d[d] * cos_d[d];
}

const BinCentres& bin_centres() {
  static const BinCentres centres = make_bin_centres();
  return centres;
}

HalfDifference Measurement::centre(int h, int d, int p) {
  const double root = (h + 0.5) / theta_h_bins;
  return {root * root * (pi / 2), radians(d + 0.5), radians(p + 0.5)};
}

Rgb Measurement::bin(int h, int d, int p) const {
  const double* value = planes_.get() + index(h, d, p);
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
