// A measured isotropic reflectance on the half-difference grid of the MERL database.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "measurement/half_difference.h"
#include "measurement/vector3.h"

namespace lobefit {

// How many of the table's bins can be used, and why the others cannot. A bin is counted once, under
// the first reason that holds: its centre lies below the horizon, a channel is not finite, a
// channel is negative.
struct BinCounts {
  int valid = 0;
  int below_horizon = 0;
  int negative = 0;
  int non_finite = 0;
};

// The format of the file that a table was read from, and what a user should know of how.
struct TableSource {
  std::string format = "MERL";
  std::vector<std::string> warnings;
};

// Reflectance f in 1/sr at the centres of 90 x 90 x 180 bins (Matusik et al. 2003):
// theta_h = ((h + .5) / 90)^2 * 90 deg, theta_d = d + .5 deg, phi_d = p + .5 deg.
class Measurement {
 public:
  static constexpr int theta_h_bins = 90;
  static constexpr int theta_d_bins = 90;
  static constexpr int phi_d_bins = 180;
  // A model sees phi_d through cos^2 alone: phi_d and 180 deg - phi_d are one of these.
  static constexpr int folded_phi_bins = phi_d_bins / 2;
  static constexpr std::ptrdiff_t row_size = std::ptrdiff_t{theta_d_bins} * phi_d_bins;
  static constexpr std::ptrdiff_t bin_count = theta_h_bins * row_size;

  // Three rows (red, green, blue) of row_size values in 1/sr: the bins of one theta_h, phi_d
  // running fastest.
  using Rows = std::array<double*, 3>;
  // Fills the rows of the h-th theta_h; may be called from several threads at once.
  using FillRows = std::function<void(int h, const Rows& rows)>;

  // Filled row by row on up to `threads` threads (0: every processor). All three channels of every
  // invalid bin become NaN.
  explicit Measurement(const FillRows& fill, int threads = 0, TableSource source = {});
  // From three planes (red, green, blue) of bin_count values in 1/sr, phi_d running fastest, then
  // theta_d.
  explicit Measurement(std::span<const double> planes);

  // The table of a reflectance given at half-difference angles; bins below the horizon are invalid.
  static Measurement tabulate(const std::function<Rgb(const HalfDifference&)>& reflectance);

  static std::ptrdiff_t index(int h, int d, int p) {
    return h * row_size + d * std::ptrdiff_t{phi_d_bins} + p;
  }
  static HalfDifference centre(int h, int d, int p);

  // The reflectance of a bin; NaN in all three channels where it is invalid.
  Rgb bin(int h, int d, int p) const;
  bool valid(int h, int d, int p) const;

  // Reflectance between the bins, for unit vectors in the local frame (n = +z): trilinear in
  // (sqrt theta_h, theta_d, phi_d) over the valid neighbours; NaN where these hold less than half
  // of the weight, and below the horizon.
  Rgb evaluate(const Vector3& wi, const Vector3& wo) const;

  const BinCounts& bins() const { return bins_; }
  const TableSource& source() const { return source_; }

  // Three planes of bin_count values, NaN where invalid.
  std::span<const double> planes() const {
    return {planes_.get(), 3 * static_cast<std::size_t>(bin_count)};
  }

 private:
  std::unique_ptr<double[]> planes_;
  BinCounts bins_;
  TableSource source_;
};

// Sines and cosines of the bins' centres, of which all that a bin's directions and lobes are made.
// The cosines of light and viewer are cos_h cos_d -+ sin_h sin_d cos_phi.
struct BinCentres {
  std::array<double, Measurement::theta_h_bins> cos_h, sin_h;
  std::array<double, Measurement::theta_d_bins> cos_d, sin_d;
  std::array<double, Measurement::phi_d_bins> cos_phi;

  // Of a bin, up to a factor: sin(theta_h) dtheta_h sin(theta_d) cos(theta_d).
  double solid_angle(int h, int d) const;
};
const BinCentres& bin_centres();

}  // namespace lobefit
