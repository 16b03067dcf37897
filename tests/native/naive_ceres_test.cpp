#include "fitting/naive_ceres.h"

#include <gtest/gtest.h>

#include "fitting/error_figures.h"
#include "fitting/fit.h"
#include "tables.h"

namespace lobefit {
namespace {

constexpr int drawn = 2700;  // bins, some 8,000 residual blocks
constexpr int threads = 2;

NaiveFit naive_fit(const Measurement& measurement) {
  Monitor monitor;
  return fit_naively(samples_for_others(measurement, drawn, threads),
                     best_start(measurement, {}, monitor), threads, monitor);
}

const Parameters known = lobe_of(40, 0.6, 1.8);

// Without noise so few bins determine the nine parameters as well as all do; 1 % is what the
// smoothing and Ceres' tolerance leave.
TEST(NaiveCeres, FindsAKnownLobe) {
  const Measurement table = table_of(known);
  const NaiveFit found = naive_fit(table);
  EXPECT_TRUE(found.converged);
  // The brightest are drawn once and would be drawn twice.
  EXPECT_NEAR(found.bins, drawn, 0.02 * drawn);
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
  const Measurement table = noisy_table_of(known, 0.1);
  Monitor monitor;
  const double fitted = fit_model(table, {}, monitor).errors.l1.pooled;
  const double naive = error_figures(table, naive_fit(table).parameters, threads).l1.pooled;
  EXPECT_LT(naive, 1.0034 * fitted);
  EXPECT_GT(naive, 0.9999 * fitted);
}

TEST(NaiveCeres, CanBeCancelled) {
  const Measurement measurement = table_of(known);
  Monitor monitor;
  const Parameters start = best_start(measurement, {}, monitor);
  monitor.cancel();
  const Samples samples = samples_for_others(measurement, drawn, threads);
  EXPECT_THROW(fit_naively(samples, start, threads, monitor), Cancelled);
}

}  // namespace
}  // namespace lobefit
