#include "measurement/spectrum.h"

#include <gtest/gtest.h>

#include <vector>

namespace lobefit {
namespace {

std::vector<float> wavelengths(float step) {
  std::vector<float> values;
  for (float w = 360; w <= 830; w += step) values.push_back(w);
  return values;
}

TEST(Spectrum, WhiteIsWhite) {
  for (const float step : {1.0f, 3.3f, 20.0f}) {
    Rgb sum = Rgb::Zero();
    for (const Rgb& weight : rgb_weights(wavelengths(step))) sum += weight;
    for (const double channel : sum) EXPECT_NEAR(channel, 1, 1e-12);
  }
}

// Light of one wavelength, by the tables of CIE 15 (colour matching functions of the 2-degree
// observer at 450, 550 and 610 nm, power of D65 there, and the sum of D65 y over 1 nm steps) and
// the matrix of IEC 61966-2-1.
TEST(Spectrum, FollowsTheTablesOfTheObserver) {
  struct Line {
    int wavelength;
    double power;
    Vector3 xyz;
  };
  const Line lines[] = {{450, 117.008, {0.3362, 0.0380, 1.77211}},
                        {550, 104.046, {0.43345, 0.994950, 0.00875}},
                        {610, 89.5991, {1.0026, 0.503, 0.00034}}};
  constexpr double luminance = 10566.9;
  Eigen::Matrix3d matrix;
  matrix << 3.2406, -1.5372, -0.4986, -0.9689, 1.8758, 0.0415, 0.0557, -0.2040, 1.0570;
  const std::vector<Rgb> weights = rgb_weights(wavelengths(1));
  for (const Line& line : lines) {
    const Rgb expected = (matrix * line.xyz).array() * line.power / luminance;
    // The fit of Wyman et al. is off by up to 2 % of the largest value.
    const double tolerance = 0.03 * expected.abs().maxCoeff();
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(weights[static_cast<std::size_t>(line.wavelength - 360)][c], expected[c],
                  tolerance)
          << line.wavelength << " nm";
    }
  }
}

}  // namespace
}  // namespace lobefit
