#include "fitting/fit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "fitting/minimise.h"
#include "fitting/samples.h"
#include "fitting/variables.h"
#include "measurement/input_error.h"
#include "reflectance/abc.h"
#include "tables.h"

namespace lobefit {
namespace {

Fit fit_of(const Measurement& measurement, const FitOptions& options) {
  Monitor monitor;
  return fit_model(measurement, options, monitor);
}

Parameters truth(ModelKind kind, double exponent, double alpha, std::optional<double> ior) {
  Parameters parameters;
  parameters.kind = kind;
  parameters.diffuse = {0.2, 0.15, 0.1};
  parameters.specular = Rgb(0.3, 0.25, 0.2) * (kind == ModelKind::interpolated ? 10 : 1);
  parameters.exponent.setConstant(exponent);
  parameters.interpolation = alpha;
  parameters.ior = ior;
  return parameters;
}

void expect_truth(const Parameters& known, const char* what) {
  FitOptions options;
  options.kind = known.kind;
  options.fresnel = known.ior.has_value();
  const Parameters found = fit_of(table_of(known), options).parameters;
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(found.diffuse[c], known.diffuse[c], 0.01 * known.diffuse[c]) << what;
    EXPECT_NEAR(found.specular[c], known.specular[c], 0.01 * known.specular[c]) << what;
    EXPECT_NEAR(found.exponent[c], known.exponent[c], 0.01 * known.exponent[c]) << what;
  }
  EXPECT_NEAR(found.interpolation, known.interpolation, 0.01) << what;
  if (known.ior) {
    EXPECT_NEAR(*found.ior, *known.ior, 0.01 * *known.ior) << what;
  }
}

// Without noise the optimum is the truth itself; 1 % is what the smoothing leaves.
TEST(Fit, FindsAKnownPhong) {
  expect_truth(truth(ModelKind::modified_phong, 40, 0, 1.5), "s = 40");
}
TEST(Fit, FindsAKnownBlinnPhong) {
  expect_truth(truth(ModelKind::modified_blinn_phong, 300, 0, std::nullopt), "s = 300");
}
TEST(Fit, FindsAKnownInterpolatedLobe) {
  expect_truth(truth(ModelKind::interpolated, 2, 0.3, 1.3), "s = 2");
  expect_truth(truth(ModelKind::interpolated, 50, 0.3, 1.5), "s = 50");
  expect_truth(truth(ModelKind::interpolated, 3000, 1, std::nullopt), "s = 3000, alpha = 1");
}

// Though one leaves a millionth of the misfit that another leaves: both are rounding.
TEST(Fit, IsCertainWhereNothingIsLeftOver) {
  const Parameters known = truth(ModelKind::interpolated, 50, 0.3, 1.5);
  const Certainty found = fit_of(table_of(known), {}).certainty;
  EXPECT_GE(found.starts, 3);
  EXPECT_EQ(found.agree, found.starts);
  EXPECT_EQ(found.spread, 0);
}

TEST(Fit, IsAsGoodAsTheTruthUnderNoiseSpikesAndLostBins) {
  const Parameters known = truth(ModelKind::interpolated, 50, 0.3, 1.5);
  const Measurement table = table_of(known);
  std::vector<double> planes(table.planes().begin(), table.planes().end());
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 0.05);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<char> spiked(planes.size(), 0);
  for (std::size_t i = 0; i < planes.size(); ++i) {
    planes[i] *= std::max(0.0, 1 + noise(random));
    const double fate = uniform(random);
    if (fate < 0.005) {
      planes[i] *= 100;
      spiked[i] = 1;
    } else if (fate < 0.007) {
      planes[i] = -planes[i];
    }
  }
  const Measurement noisy(planes);
  const Parameters found = fit_of(noisy, {}).parameters;
  double of_truth = 0, of_fit = 0;
  for (int i = 0; i < Measurement::bin_count; ++i) {
    const int p = i % 180, d = i / 180 % 90, h = i / 180 / 90;
    if (!noisy.valid(h, d, p)) continue;
    const HalfDifference centre = Measurement::centre(h, d, p);
    const Rgb a = evaluate_model(known, centre), b = evaluate_model(found, centre);
    for (int c = 0; c < 3; ++c) {
      const auto at = static_cast<std::size_t>(i + c * Measurement::bin_count);
      if (spiked[at]) continue;
      of_truth += std::abs(a[c] - planes[at]);
      of_fit += std::abs(b[c] - planes[at]);
    }
  }
  EXPECT_LE(of_fit, 1.005 * of_truth);
}

// For a fixed shape, rho_d and k_s of a channel are a least-absolute-deviation line through the
// points (g, m), a convex problem: for each k the best rho_d is a median, and the best k is found
// by ternary search. It is slow and sure, and certifies what the solver found.
double certified_least_l1(const std::vector<double>& g, const std::vector<double>& m) {
  const auto at = [&](double k) {
    std::vector<double> rest(g.size());
    for (std::size_t i = 0; i < g.size(); ++i) rest[i] = m[i] - k * g[i];
    const auto middle = rest.begin() + static_cast<std::ptrdiff_t>(rest.size() / 2);
    std::nth_element(rest.begin(), middle, rest.end());
    const double d = std::max(0.0, *middle);
    double sum = 0;
    for (std::size_t i = 0; i < g.size(); ++i) sum += std::abs(m[i] - k * g[i] - d);
    return sum;
  };
  double low = 0, high = 0;
  const double most = *std::max_element(g.begin(), g.end());
  for (std::size_t i = 0; i < g.size(); ++i) {
    if (g[i] > 0.01 * most) high = std::max(high, m[i] / g[i]);
  }
  for (int i = 0; i < 60; ++i) {
    const double a = low + (high - low) / 3, b = high - (high - low) / 3;
    if (at(a) < at(b)) {
      high = b;
    } else {
      low = a;
    }
  }
  return at((low + high) / 2);
}

TEST(Minimise, FindsTheCertifiedReflectancesOfAShape) {
  FitOptions options;
  options.max_angle_degrees = 20;  // few enough bins for the slow certificate
  const Samples samples = all_samples(sample_measurement("nickel"), options);
  const Variables variables(options.kind, false, false);
  Eigen::VectorXd x(8);
  x << 1, 1, 1, 10, 10, 10, std::log(300.0), 1;
  const Monitor monitor;
  const double found = minimise(samples, variables, Norm::l1, variables.reflectances(), x,
                                fine_precision(), 1, monitor)
                           .true_value;
  double least = 0;
  for (const auto& channel : samples.measured) {
    std::vector<double> g, m;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (!(samples.weight[i] > 0)) continue;
      for (const auto& half : channel) {
        g.push_back(lobe_power({samples.u_phong[i], samples.u_blinn[i], 1}, 1, 300));
        m.push_back(half[i]);
      }
    }
    least += certified_least_l1(g, m);
  }
  EXPECT_GE(found, least * (1 - 1e-9));
  // Smoothing at a hundredth of the median, and stopping at a relative change of 1e-7.
  EXPECT_LE(found, least * 1.001);
}

TEST(Fit, PolishIsNoWorseThanStages) {
  for (const char* name : {"nickel", "red-fabric2"}) {
    const Measurement sample = sample_measurement(name);
    FitOptions options;
    const double polished = fit_of(sample, options).errors.l1.pooled;
    options.schedule = Schedule::stages;
    const Fit staged = fit_of(sample, options);
    EXPECT_EQ(staged.stages.size(), 3u);
    EXPECT_LE(polished, staged.errors.l1.pooled * (1 + 1e-6)) << name;
  }
}

TEST(Fit, ReportsTheErrorThatItMinimised) {
  const Fit fit = fit_of(sample_measurement("violet-rubber"), {});
  // Stored as float for the passes, in double for the report.
  EXPECT_NEAR(fit.stages.back().error, fit.errors.l1.pooled, 1e-6 * fit.errors.l1.pooled);
}

TEST(Fit, TellsAtWhichAnglesTheErrorStands) {
  const ErrorFigures errors = fit_of(sample_measurement("nickel"), {}).errors;
  double misfit = 0, measured = 0, seen_misfit = 0, seen = 0;
  for (const auto& row : errors.by_angle.half_difference) {
    for (const ErrorByAngle::Part& part : row) {
      misfit += part.misfit;
      measured += part.measured;
    }
  }
  for (const ErrorByAngle::Part& part : errors.by_angle.view) {
    seen_misfit += part.misfit;
    seen += part.measured;
  }
  // Sums of a million terms in another order.
  EXPECT_NEAR(measured, 1, 1e-9);
  EXPECT_NEAR(seen, 1, 1e-9);
  EXPECT_NEAR(misfit, errors.relative_l1.pooled, 1e-9);
  EXPECT_NEAR(seen_misfit, errors.relative_l1_cosine.pooled, 1e-9);
}

// A table that is wrong only where light or viewer stand at 62 to 63 degrees has its error in the
// step of 60 to 65 degrees and in those of the other direction, which are spread out.
TEST(Fit, FindsTheViewAngleOfAnError) {
  Parameters flat;
  flat.diffuse = {0.5, 0.4, 0.3};
  const Measurement wrong = Measurement::tabulate([&](const HalfDifference& at) {
    const Directions to = to_directions(at);
    const double view = degrees(std::acos(to.wo.z()));
    return Rgb(evaluate_model(flat, at) * (view > 62 && view < 63 ? 2 : 1));
  });
  const auto views = error_figures(wrong, flat, 1).by_angle.view;
  const auto most = std::max_element(views.begin(), views.end(), [](const auto& a, const auto& b) {
    return a.misfit / a.measured < b.misfit / b.measured;
  });
  EXPECT_EQ(most - views.begin(), 12);
}

// Under noise of 10 % all bins determine one optimum, to the 1e-4 that the smoothing leaves. Of the
// 32,000 bins of a subsample nine parameters take up their share, 1e-4 of the error as well.
TEST(Fit, HasOneOptimumByEverySchedule) {
  const Parameters known = truth(ModelKind::interpolated, 40, 0.6, 1.8);
  const Measurement table = noisy_table_of(known, 0.1);
  const auto fitted = [&](Schedule schedule) {
    Fit fit = fit_of(table, {.schedule = schedule});
    EXPECT_NEAR(fit.stages.back().error, fit.errors.l1.pooled, 1e-6 * fit.errors.l1.pooled);
    return fit;
  };
  const Fit joint = fitted(Schedule::joint), part = fitted(Schedule::subsample);
  const double least = fitted(Schedule::polish).errors.l1.pooled;
  EXPECT_NEAR(joint.errors.l1.pooled, least, 1e-4 * least);
  EXPECT_NEAR(part.errors.l1.pooled, least, 1e-3 * least);
  EXPECT_LT(part.stages.back().samples, joint.stages.back().samples / 10);
  EXPECT_LT(part.stages.back().touched, joint.stages.back().touched);
}

TEST(Fit, OfTheCosineNormHasTheLeastCosineError) {
  const Measurement sample = sample_measurement("nickel");
  FitOptions options;
  const double plain = fit_of(sample, options).errors.relative_l1_cosine.pooled;
  options.norm = Norm::cosine_l1;
  EXPECT_LT(fit_of(sample, options).errors.relative_l1_cosine.pooled, plain);
}

TEST(Fit, LeavesOutWhatStandsBeyondTheAngleAskedFor) {
  const Measurement sample = sample_measurement("nickel");
  FitOptions options;
  const double everywhere = fit_of(sample, options).errors.relative_l1_80.pooled;
  options.max_angle_degrees = 80;
  EXPECT_LT(fit_of(sample, options).errors.relative_l1_80.pooled, everywhere);
}

TEST(Fit, OfSeparateChannelsFindsAnExponentForEach) {
  Parameters known = truth(ModelKind::interpolated, 50, 0.3, std::nullopt);
  known.exponent = {30, 60, 120};
  FitOptions options;
  options.fresnel = false;
  options.separate_channels = true;
  const Parameters found = fit_of(table_of(known), options).parameters;
  EXPECT_LT((found.exponent / known.exponent - 1).abs().maxCoeff(), 0.01);
}

TEST(Fit, NamesAnOutcomeWithoutSpecularPart) {
  Parameters flat;
  flat.diffuse = {0.5, 0.4, 0.3};
  const Fit fit = fit_of(table_of(flat), {});
  EXPECT_LT(fit.errors.relative_l1.pooled, 1e-3);
  EXPECT_FALSE(fit.warnings.empty());
}

TEST(Fit, OfExtremeTablesIsFinite) {
  const auto finite = [](const Fit& fit) {
    const Parameters& p = fit.parameters;
    return p.diffuse.isFinite().all() && p.specular.isFinite().all() &&
           p.exponent.isFinite().all() && std::isfinite(p.ior.value_or(1)) &&
           std::isfinite(fit.errors.relative_l1.pooled);
  };
  const auto plane_of = [](auto value) {
    std::vector<double> planes(3 * static_cast<std::size_t>(Measurement::bin_count));
    for (std::size_t i = 0; i < planes.size(); ++i) planes[i] = value(i);
    return Measurement(planes);
  };
  EXPECT_TRUE(finite(fit_of(plane_of([](std::size_t) { return 0.0; }), {})));
  EXPECT_TRUE(finite(fit_of(plane_of([](std::size_t i) { return i % 100000 ? 0.0 : 5.0; }), {})));
  const auto few = [](std::size_t i) { return i % Measurement::bin_count % 9999 ? -1.0 : 5.0; };
  EXPECT_TRUE(finite(fit_of(plane_of(few), {})));
  // Here no bin has a value in all three channels, and a fit would be of nothing.
  const auto none = [](std::size_t i) { return i % 9999 ? -1.0 : 5.0; };
  EXPECT_THROW(fit_of(plane_of(none), {}), InputError);
  const Measurement nickel = sample_measurement("nickel");
  std::vector<double> tiny(nickel.planes().begin(), nickel.planes().end());
  for (double& value : tiny) value *= 1e-30;
  const Fit fit = fit_of(Measurement(tiny), {});
  EXPECT_TRUE(finite(fit));
  EXPECT_LT(fit.errors.relative_l1.pooled, 0.5);
}

}  // namespace
}  // namespace lobefit
