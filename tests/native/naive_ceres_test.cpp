#include "fitting/naive_ceres.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fitting/error_figures.h"
#include "fitting/fit.h"
#include "measurement/half_difference.h"
#include "reflectance/model.h"

namespace lobefit {
namespace {

constexpr int thinned = 401;  // some 8,000 residual blocks
constexpr int threads = 2;

NaiveFit naive_fit(const Measurement& measurement) {
  Monitor monitor;
  return fit_naively(measurement, best_start(measurement, {}, monitor), thinned, threads, monitor);
}

// A lobe under noise of so many parts of itself, the same at every run.
Measurement noisy_lobe(const Parameters& known, double noise) {
  return Measurement::tabulate([&](const HalfDifference& at) -> Rgb {
    const double phase = 1e4 * at.theta_h + 7e3 * at.theta_d + 3e3 * at.phi_d;
    return evaluate_model(known, at) * (1 + noise * std::sin(phase));
  });
}

Parameters known_lobe() {
  Parameters known;
  known.diffuse = {0.2, 0.15, 0.1};
  known.specular = {3, 2.5, 2};
  known.exponent.setConstant(40);
  known.interpolation = 0.6;
  known.ior = 1.8;
  return known;
}

// Without noise one bin in 401 determines the nine parameters as well as all do; 1 % is what the
// smoothing and Ceres' tolerance leave.
TEST(NaiveCeres, FindsAKnownLobe) {
  const Parameters known = known_lobe();
  const Measurement table = noisy_lobe(known, 0);
  const NaiveFit found = naive_fit(table);
  EXPECT_TRUE(found.converged);
  EXPECT_NEAR(found.bins, table.bins().valid / thinned, 1);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(found.parameters.diffuse[c], known.diffuse[c], 0.01 * known.diffuse[c]);
    EXPECT_NEAR(found.parameters.specular[c], known.specular[c], 0.01 * known.specular[c]);
  }
  EXPECT_NEAR(found.parameters.exponent[0], 40, 0.4);
  EXPECT_NEAR(found.parameters.interpolation, 0.6, 0.01);
  EXPECT_NEAR(*found.parameters.ior, 1.8, 0.018);
}

// Two programs for one objective. Nine parameters take up their share of the error of 2,700 bins,
// three channels each, some 9 / 8,100 of it; three times that is allowed. It cannot be below that
// of all bins but for the smoothing.
TEST(NaiveCeres, ComesToTheErrorOfTheFit) {
  const Measurement table = noisy_lobe(known_lobe(), 0.1);
  Monitor monitor;
  const double fitted = fit_model(table, {}, monitor).errors.l1.pooled;
  const double naive = error_figures(table, naive_fit(table).parameters, threads).l1.pooled;
  EXPECT_LT(naive, 1.0034 * fitted);
  EXPECT_GT(naive, 0.9999 * fitted);
}

TEST(NaiveCeres, CanBeCancelled) {
  const Measurement measurement = noisy_lobe(known_lobe(), 0);
  Monitor monitor;
  const Parameters start = best_start(measurement, {}, monitor);
  monitor.cancel();
  EXPECT_THROW(fit_naively(measurement, start, thinned, threads, monitor), Cancelled);
}

}  // namespace
}  // namespace lobefit
