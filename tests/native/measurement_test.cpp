#include "measurement/measurement.h"

#include <gtest/gtest.h>

#include <cmath>
#include <span>
#include <stdexcept>
#include <vector>

#include "reflectance/abc.h"
#include "reflectance/model.h"

namespace lobefit {
namespace {

TEST(Measurement, IsItsBinsAtTheirCentres) {
  const Measurement sample = sample_measurement("violet-rubber");
  for (const auto [h, d, p] : {std::array{5, 7, 11}, {40, 20, 90}, {70, 3, 179}, {20, 60, 0}}) {
    const Directions at = to_directions(Measurement::centre(h, d, p));
    const Rgb value = sample.evaluate(at.wi, at.wo), bin = sample.bin(h, d, p);
    // The grid coordinate of a centre is known to some 1e-12 of a bin, over which the table changes
    // by less than a hundredth of itself.
    EXPECT_LT((value - bin).abs().maxCoeff(), 1e-10 * bin.maxCoeff()) << h << " " << d << " " << p;
  }
}

TEST(Measurement, IsContinuousWhereTheAzimuthWrapsAround) {
  const Measurement sample = sample_measurement("violet-rubber");
  const Directions before = to_directions({0.5, 0.6, 1e-9}),
                   after = to_directions({0.5, 0.6, pi - 1e-9});
  const Rgb a = sample.evaluate(before.wi, before.wo), b = sample.evaluate(after.wi, after.wo);
  EXPECT_LT((a - b).abs().maxCoeff(), 1e-6 * a.maxCoeff());
}

TEST(Measurement, IsUnknownBelowTheHorizonAndAmongInvalidBins) {
  const Measurement sample = sample_measurement("nickel");
  EXPECT_TRUE(std::isnan(sample.evaluate({0, 0, 1}, {1, 0, -1e-9})[0]));
  std::vector<double> planes(sample.planes().begin(), sample.planes().end());
  for (int d = 9; d < 12; ++d) {
    for (int h = 9; h < 12; ++h) {
      for (int p = 0; p < Measurement::phi_d_bins; ++p) {
        planes[static_cast<std::size_t>(Measurement::index(h, d, p))] = -1;
      }
    }
  }
  const Measurement with_hole(std::move(planes));
  const Directions inside = to_directions(Measurement::centre(10, 10, 30));
  EXPECT_TRUE(std::isnan(with_hole.evaluate(inside.wi, inside.wo)[1]));
}

TEST(Measurement, InterpolatesBetweenBins) {
  Parameters parameters;
  parameters.diffuse = {0.3, 0.2, 0.1};
  parameters.specular = {2, 1, 0.5};
  parameters.exponent.setConstant(8);
  parameters.interpolation = 0.5;
  parameters.ior = 1.5;
  const Measurement table = Measurement::tabulate(
      [&](const HalfDifference& at) { return evaluate_model(parameters, at); });
  for (double theta = 0.05; theta < 1.3; theta += 0.11) {
    const Vector3 wi(std::sin(theta), 0, std::cos(theta));
    const Vector3 wo = Vector3(-0.3, 0.2, 0.8).normalized();
    const Rgb exact = evaluate_model(parameters, wi, wo), found = table.evaluate(wi, wo);
    // A lobe this wide bends by less than 1 % within a bin of one degree.
    EXPECT_LT((exact - found).abs().maxCoeff(), 0.01 * exact.maxCoeff());
  }
}

TEST(Sample, IsThePublishedFitAtABin) {
  // Low et al. 2012, two-layer-silver has no diffuse part; bin (0, 0, 0) is close to the peak,
  // where D = A / (1 + B (1 - cos theta_h))^C and F is that of normal incidence.
  const Measurement sample = sample_measurement("two-layer-silver");
  const HalfDifference at = Measurement::centre(0, 0, 0);
  const double rise = 2 * std::pow(std::sin(at.theta_h / 2), 2);
  const double normal_fresnel = std::pow((8.718435 - 1) / (8.718435 + 1), 2);
  const double expected =
      125.852753 / std::pow(1 + 1048834.875 * rise, 0.598443) * normal_fresnel / pi;
  // Half a degree of incidence changes the Fresnel term and the cosines by less than 1e-3.
  EXPECT_NEAR(sample.bin(0, 0, 0)[0], expected, 1e-3 * expected);
}

TEST(Measurement, RefusesPlanesOfAnotherSize) {
  const std::vector<double> few(10, 0.5);
  EXPECT_THROW(Measurement{std::span<const double>(few)}, std::invalid_argument);
}

}  // namespace
}  // namespace lobefit
