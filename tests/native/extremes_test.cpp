#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <string>

#include "fitting/fit.h"
#include "fitting/variables.h"
#include "measurement/input_error.h"
#include "tables.h"

namespace lobefit {
namespace {

Fit fit_of(const Measurement& measurement, const FitOptions& options = {}) {
  Monitor monitor;
  return fit_model(measurement, options, monitor);
}

int iterations_of(const Fit& fit) {
  int sum = 0;
  for (const Stage& stage : fit.stages) sum += stage.iterations;
  return sum;
}

bool is_finite(const ErrorFigure& figure) {
  return std::isfinite(figure.pooled) && figure.rgb.isFinite().all();
}

// Whatever a fit tells, the record can hold (JSON knows no NaN), and lies within the bounds.
void expect_usable(const Fit& fit, const FitOptions& options) {
  const Parameters& p = fit.parameters;
  EXPECT_TRUE((p.diffuse >= 0).all() && p.diffuse.isFinite().all()) << p.diffuse;
  EXPECT_TRUE((p.specular >= 0).all() && p.specular.isFinite().all()) << p.specular;
  // The bounds of Variables; exp(log(bound)) rounds.
  EXPECT_TRUE((p.exponent > 0.99e-4).all() && (p.exponent < 1.01e8).all()) << p.exponent;
  EXPECT_TRUE(p.interpolation >= 0 && p.interpolation <= 1) << p.interpolation;
  if (options.fresnel) {
    EXPECT_TRUE(*p.ior > 1 && *p.ior < 200.1) << *p.ior;
  }
  for (const ErrorFigure& figure : {fit.errors.l1, fit.errors.relative_l1,
                                    fit.errors.relative_l1_80, fit.errors.relative_l1_cosine}) {
    EXPECT_TRUE(is_finite(figure));
  }
  for (const Stage& stage : fit.stages) EXPECT_TRUE(std::isfinite(stage.error)) << stage.name;
  EXPECT_TRUE(std::isfinite(fit.certainty.spread));
  if (fit.uncertainty) {
    EXPECT_TRUE(fit.uncertainty->correlation.allFinite());
    EXPECT_TRUE(fit.uncertainty->high.diffuse.isFinite().all());
    EXPECT_TRUE(fit.uncertainty->high.specular.isFinite().all());
  }
  // Eight starts and three finalists, with a level of at most three full solves for every factor of
  // 4 between the mean misfit and the finest smoothing; an ordinary table takes 90 to 1000.
  EXPECT_LT(iterations_of(fit), 10000);
}

class EveryExtreme : public ::testing::TestWithParam<ExtremeTable> {};

std::string test_name(const ::testing::TestParamInfo<ExtremeTable>& info) {
  std::string name = std::to_string(info.index) + "_" + info.param.name;
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return !std::isalnum(c); }, '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(Tables, EveryExtreme, ::testing::ValuesIn(extreme_tables()), test_name);

TEST_P(EveryExtreme, HasAUsableFitOrANamedWarning) {
  const Measurement measurement = GetParam().make();
  const Fit fit = fit_of(measurement);
  expect_usable(fit, {});
  if (GetParam().degenerate) {
    EXPECT_FALSE(fit.warnings.empty());
  }
  const double error = fit.errors.relative_l1.pooled;
  // Black has the error 1.
  EXPECT_TRUE(error < 0.999 || !fit.warnings.empty()) << error;
  if (GetParam().truth) {
    const double of_truth = error_figures(measurement, *GetParam().truth, 0).relative_l1.pooled;
    // Smoothing at a hundredth of the median leaves 1e-5 at most; where nearly half of the values
    // are spikes the minimum is so flat that the fit ends half a per cent above it.
    EXPECT_LE(error, 1.005 * of_truth + 1e-5);
  }
}

TEST(Extremes, WithoutAValidBinAreRefusedInASentence) {
  try {
    fit_of(no_valid_bin());
    FAIL() << "fitted";
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(),
                 "expected reflectances within 90 degrees of the normal, found no valid bin.");
  }
  // The one valid bin has its light and viewer beyond 30 degrees.
  const Measurement grazing = table_of(
      [](int h, int d, int p) { return Rgb::Constant(h == 5 && d == 40 && p == 50 ? 1 : -1); });
  FitOptions options;
  options.max_angle_degrees = 30;
  EXPECT_THROW(fit_of(grazing, options), InputError);
}

TEST(Extremes, ScaleTheirParametersAndNothingElse) {
  for (const ExtremeTable& table : extreme_tables()) {
    if (table.name != "checkerboard of invalid bins" && table.name != "ABC sample red-fabric2") {
      continue;
    }
    const Measurement one = table.make();
    const Fit plain = fit_of(one);
    for (const double factor : {1e-30, 1e30}) {
      std::vector<double> planes(one.planes().begin(), one.planes().end());
      for (double& value : planes) value *= factor;
      const Fit scaled = fit_of(Measurement(planes));
      const Parameters &a = plain.parameters, &b = scaled.parameters;
      // Values over their median round differently in float; the flat minimum makes more of it.
      constexpr double tolerance = 1e-4;
      EXPECT_LT((b.diffuse - factor * a.diffuse).abs().maxCoeff(),
                tolerance * factor * a.diffuse.maxCoeff());
      EXPECT_LT((b.specular - factor * a.specular).abs().maxCoeff(),
                tolerance * factor * a.specular.maxCoeff());
      EXPECT_LT((b.exponent / a.exponent - 1).abs().maxCoeff(), tolerance);
      EXPECT_NEAR(b.interpolation, a.interpolation, tolerance);
      EXPECT_NEAR(*b.ior, *a.ior, tolerance * *a.ior);
      EXPECT_NEAR(scaled.errors.relative_l1.pooled, plain.errors.relative_l1.pooled, 1e-7);
      EXPECT_NEAR(scaled.errors.l1.pooled / factor, plain.errors.l1.pooled,
                  1e-6 * plain.errors.l1.pooled + 1e-12);
    }
  }
}

// The nastiest tables by every norm, schedule and kind of model.
TEST(Extremes, AreFiniteWhateverIsAsked) {
  std::vector<FitOptions> asked(9);
  asked[0].norm = Norm::cosine_l1;
  asked[1].norm = Norm::l2;
  asked[2].norm = Norm::log_l2;
  asked[3].schedule = Schedule::stages;
  asked[4].kind = ModelKind::modified_phong;
  asked[5].kind = ModelKind::modified_blinn_phong;
  asked[6].separate_channels = true;
  asked[7].fresnel = false;
  asked[8].uncertainty = true;
  for (const ExtremeTable& table : extreme_tables()) {
    const bool nasty = table.name == "all zero" || table.name == "one valid bin" ||
                       table.name == "one bin of 1e300" || table.name == "a lobe on black" ||
                       table.name == "times 1e-310 (denormals)";
    if (!nasty) continue;
    const Measurement measurement = table.make();
    for (std::size_t i = 0; i < asked.size(); ++i) {
      SCOPED_TRACE(table.name + ", option " + std::to_string(i));
      expect_usable(fit_of(measurement, asked[i]), asked[i]);
    }
  }
}

}  // namespace
}  // namespace lobefit
