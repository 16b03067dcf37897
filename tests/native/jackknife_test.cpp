#include "fitting/jackknife.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "fitting/fit.h"
#include "fitting/minimise.h"
#include "reflectance/abc.h"
#include "tables.h"

namespace lobefit {
namespace {

using Eigen::VectorXd;

Parameters lobe(double exponent, double alpha, double ior) {
  Parameters parameters;
  parameters.diffuse = {0.2, 0.15, 0.1};
  parameters.specular = {10, 9, 8};
  parameters.exponent.setConstant(exponent);
  parameters.interpolation = alpha;
  parameters.ior = ior;
  return parameters;
}

// The table times 1 + noise of two kinds, each of standard deviation `sigma`: one that is the same
// all over patches of 3 x 3 steps of theta_h and theta_d, since errors of a measurement go
// together, and one of every bin by itself. Both are the same in all channels.
Measurement with_noise(const Measurement& table, double sigma, std::mt19937& random) {
  constexpr std::ptrdiff_t patch = 3, patches = Measurement::theta_d_bins / patch;
  std::normal_distribution<double> noise(0, sigma);
  std::vector<double> of_patch(static_cast<std::size_t>(patches * patches));
  for (double& value : of_patch) value = noise(random);
  std::vector<double> planes(table.planes().begin(), table.planes().end());
  for (int i = 0; i < Measurement::bin_count; ++i) {
    const int d = i / Measurement::phi_d_bins % Measurement::theta_d_bins;
    const auto h = static_cast<int>(i / Measurement::row_size);
    const double factor =
        1 + noise(random) + of_patch[static_cast<std::size_t>(h / patch * patches + d / patch)];
    for (int c = 0; c < 3; ++c) {
      planes[static_cast<std::size_t>(i + c * Measurement::bin_count)] *= factor;
    }
  }
  return Measurement(planes);
}

bool names(const Uncertainty& found, const std::string& variable) {
  return std::find(found.undetermined.begin(), found.undetermined.end(), variable) !=
         found.undetermined.end();
}

Fit fit_with_uncertainty(const Measurement& measurement, FitOptions options = {}) {
  options.uncertainty = true;
  Monitor monitor;
  return fit_model(measurement, options, monitor);
}

TEST(Jackknife, BlocksAreWidePatchesOfAboutOneSize) {
  const Samples samples = subsample(all_samples(table_of(lobe(40, 0.6, 1.8)), {}), 16000);
  const std::vector<int> block = jackknife_block_of(samples);
  std::vector<int> sizes(jackknife_blocks, 0);
  int all = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (!(samples.weight[i] > 0)) continue;
    ++sizes.at(static_cast<std::size_t>(block[i]));
    ++all;
  }
  // A strip ends with a whole step of theta_d, a patch with a whole one of theta_h.
  const int even = all / jackknife_blocks;
  EXPECT_GT(*std::min_element(sizes.begin(), sizes.end()), even / 2);
  EXPECT_LT(*std::max_element(sizes.begin(), sizes.end()), 2 * even);
}

// Of intervals of 95 % over 24 draws fewer than 18 cover the truth less often than once in 10,000.
TEST(Jackknife, IntervalsCoverTheTruthAboutAsOftenAsTheySay) {
  constexpr int draws = 24;
  const Parameters known = lobe(40, 0.6, 1.8);
  const Measurement table = table_of(known);
  const FitOptions options;
  const Variables variables(options.kind, options.fresnel, options.separate_channels);
  const Monitor monitor;
  std::mt19937 random(11);
  std::vector<int> covered(static_cast<std::size_t>(variables.count()), 0);
  for (int draw = 0; draw < draws; ++draw) {
    const Samples samples = subsample(all_samples(with_noise(table, 0.05, random), options), 16000);
    const VectorXd from = variables.from_parameters(known, samples.unit);
    const VectorXd x = minimise(samples, variables, options.norm, variables.all(), from,
                                finishing_precision(), 2, monitor)
                           .x;
    const Uncertainty found = jackknife(samples, variables, options.norm, x, 2, monitor);
    const auto count = [&](int i, double low, double truth, double high) {
      covered[static_cast<std::size_t>(i)] += low <= truth && truth <= high;
    };
    for (int c = 0; c < 3; ++c) {
      count(c, found.low.diffuse[c], known.diffuse[c], found.high.diffuse[c]);
      count(3 + c, found.low.specular[c], known.specular[c], found.high.specular[c]);
    }
    count(6, found.low.exponent[0], known.exponent[0], found.high.exponent[0]);
    count(7, found.low.interpolation, known.interpolation, found.high.interpolation);
    count(8, *found.low.ior, *known.ior, *found.high.ior);
  }
  for (std::size_t i = 0; i < covered.size(); ++i) {
    EXPECT_GE(covered[i], 0.75 * draws) << variables.names()[i];
  }
}

TEST(Jackknife, DeterminesASharpLobe) {
  std::mt19937 random(12);
  const Fit fit = fit_with_uncertainty(with_noise(table_of(lobe(300, 0.7, 1.8)), 0.02, random));
  EXPECT_EQ(fit.uncertainty->undetermined, std::vector<std::string>());
}

// Within 40 degrees Fresnel's factor hardly changes, so that the index of refraction and the
// specular coefficient make one number, and a lobe of s = .1 is as wide as the diffuse part.
TEST(Jackknife, NamesWhatARidgeLeavesOpen) {
  std::mt19937 random(13);
  FitOptions options;
  options.max_angle_degrees = 40;
  const Fit narrow =
      fit_with_uncertainty(with_noise(table_of(lobe(40, 0.6, 1.5)), 0.05, random), options);
  EXPECT_TRUE(names(*narrow.uncertainty, "ior"));
  EXPECT_TRUE(names(*narrow.uncertainty, "specular red"));
  EXPECT_FALSE(names(*narrow.uncertainty, "exponent"));
  const Fit wide =
      fit_with_uncertainty(with_noise(table_of(lobe(0.1, 0.6, 1.5)), 0.05, random), options);
  EXPECT_TRUE(names(*wide.uncertainty, "exponent"));
  EXPECT_TRUE(names(*wide.uncertainty, "diffuse red"));
}

TEST(Jackknife, NamesTheShapeOfNoLobe) {
  Parameters flat;
  flat.diffuse = {0.5, 0.4, 0.3};
  const Fit fit = fit_with_uncertainty(table_of(flat));
  const Uncertainty& found = *fit.uncertainty;
  for (const char* variable : {"exponent", "interpolation", "ior"}) {
    EXPECT_TRUE(names(found, variable)) << variable;
  }
  EXPECT_FALSE(names(found, "diffuse red"));
  EXPECT_EQ(found.low.interpolation, 0);
  EXPECT_EQ(found.high.interpolation, 1);
  EXPECT_TRUE(found.correlation.allFinite());
  EXPECT_TRUE(found.low.exponent.isFinite().all() && found.high.exponent.isFinite().all());
}

TEST(Jackknife, OfATableWithoutReflectanceIsFinite) {
  const std::vector<double> planes(3 * static_cast<std::size_t>(Measurement::bin_count), 0);
  const Uncertainty found = *fit_with_uncertainty(Measurement(planes)).uncertainty;
  EXPECT_TRUE(found.correlation.allFinite());
  EXPECT_TRUE(found.high.diffuse.isFinite().all() && found.high.specular.isFinite().all());
}

TEST(Jackknife, IsTheSameForAnyNumberOfThreads) {
  const Measurement sample = sample_measurement("violet-rubber");
  FitOptions options;
  options.threads = 1;
  const Uncertainty one = *fit_with_uncertainty(sample, options).uncertainty;
  for (const int threads : {2, 3}) {
    options.threads = threads;
    const Uncertainty other = *fit_with_uncertainty(sample, options).uncertainty;
    EXPECT_EQ(one.correlation, other.correlation);
    EXPECT_TRUE((one.low.exponent == other.low.exponent).all());
    EXPECT_TRUE((one.high.specular == other.high.specular).all());
    EXPECT_EQ(one.undetermined, other.undetermined);
  }
}

TEST(Jackknife, CanBeCancelled) {
  const FitOptions options;
  const Samples samples = subsample(all_samples(sample_measurement("nickel"), options), 2000);
  const Variables variables(options.kind, options.fresnel, options.separate_channels);
  Monitor monitor;
  monitor.cancel();
  EXPECT_THROW(
      jackknife(samples, variables, options.norm, VectorXd::Ones(variables.count()), 2, monitor),
      Cancelled);
}

}  // namespace
}  // namespace lobefit
