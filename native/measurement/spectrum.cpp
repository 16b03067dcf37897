#include "measurement/spectrum.h"

#include <array>
#include <cmath>

namespace lobefit {
namespace {

// The relative power of the CIE standard illuminant D65 at 360, 370 .. 830 nm (ISO 11664-2).
constexpr double d65_first = 360, d65_step = 10;
constexpr std::array<double, 48> d65 = {
    46.6383, 52.0891, 49.9755, 54.6482, 82.7549, 91.4860, 93.4318, 86.6823, 104.865, 117.008,
    117.812, 114.861, 115.923, 108.811, 109.354, 107.802, 104.790, 107.689, 104.405, 104.046,
    100.000, 96.3342, 95.7880, 88.6856, 90.0062, 89.5991, 87.6987, 83.2886, 83.6992, 80.0268,
    80.2146, 82.2778, 78.2842, 69.7213, 71.6091, 74.3490, 61.6040, 69.8856, 75.0870, 63.5927,
    46.4182, 66.8054, 63.3828, 64.3040, 59.4519, 51.9590, 57.4406, 60.3125};

double daylight(double wavelength) {
  const double at = (wavelength - d65_first) / d65_step;
  if (!(at >= 0 && at <= static_cast<double>(d65.size() - 1))) return 0;
  const std::size_t below = std::min(static_cast<std::size_t>(at), d65.size() - 2);
  return std::lerp(d65[below], d65[below + 1], at - static_cast<double>(below));
}

// A Gaussian lobe whose widths (nm) below and above its centre differ.
double lobe(double wavelength, double centre, double below, double above) {
  return std::exp(-square((wavelength - centre) / (wavelength < centre ? below : above)) / 2);
}

// The CIE 1931 2-degree colour matching functions as sums of lobes: Wyman, Sloan and Shirley,
// "Simple analytic approximations to the CIE XYZ color matching functions", JCGT 2(2), 2013.
Vector3 colour_matching(double w) {
  return {1.056 * lobe(w, 599.8, 37.9, 31.0) + 0.362 * lobe(w, 442.0, 16.0, 26.7) -
              0.065 * lobe(w, 501.1, 20.4, 26.2),
          0.821 * lobe(w, 568.8, 46.9, 40.5) + 0.286 * lobe(w, 530.9, 16.3, 31.1),
          1.217 * lobe(w, 437.0, 11.8, 36.0) + 0.681 * lobe(w, 459.0, 26.0, 13.8)};
}

// From XYZ to the primaries of ITU-R BT.709 with the white D65.
Eigen::Matrix3d xyz_to_rec709() {
  return (Eigen::Matrix3d() << 3.2404542, -1.5371385, -0.4985314, -0.9692660, 1.8760108, 0.0415560,
          0.0556434, -0.2040259, 1.0572252)
      .finished();
}

}  // namespace

std::vector<Rgb> rgb_weights(std::span<const float> wavelengths) {
  std::vector<Rgb> weights;
  Rgb total = Rgb::Zero();
  const std::size_t last = wavelengths.size() - 1;
  for (std::size_t i = 0; i <= last; ++i) {
    const double below = wavelengths[i == 0 ? 0 : i - 1],
                 above = wavelengths[std::min(i + 1, last)];
    const double w = wavelengths[i];
    weights.emplace_back((xyz_to_rec709() * colour_matching(w)).array() *
                         ((above - below) / 2 * daylight(w)));
    total += weights.back();
  }
  for (Rgb& weight : weights) weight /= total;
  return weights;
}

}  // namespace lobefit
