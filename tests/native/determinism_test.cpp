// A fit is the same whatever computes it: any number of threads, and either version of the kernel.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <string>

#include "fitting/fit.h"
#include "fitting/objective.h"
#include "measurement/instructions.h"
#include "reflectance/abc.h"
#include "tables.h"

namespace lobefit {
namespace {

using Eigen::VectorXd;

Fit fit_of(const Measurement& measurement, const FitOptions& options) {
  Monitor monitor;
  return fit_model(measurement, options, monitor);
}

const Measurement& sample() {
  static const Measurement measurement = sample_measurement("violet-rubber");
  return measurement;
}

const Measurement& damaged_sample() {
  static const Measurement measurement = table_of([](int h, int d, int p) -> Rgb {
    return (h + d + p) % 2 || !sample().valid(h, d, p) ? Rgb::Constant(-1) : sample().bin(h, d, p);
  });
  return measurement;
}

void expect_same(const ErrorFigure& one, const ErrorFigure& other) {
  EXPECT_EQ(one.pooled, other.pooled);
  EXPECT_TRUE((one.rgb == other.rgb).all());
}

void expect_same(const Fit& one, const Fit& other) {
  const Parameters &a = one.parameters, &b = other.parameters;
  EXPECT_TRUE((a.diffuse == b.diffuse).all());
  EXPECT_TRUE((a.specular == b.specular).all());
  EXPECT_TRUE((a.exponent == b.exponent).all());
  EXPECT_EQ(a.interpolation, b.interpolation);
  EXPECT_EQ(a.ior, b.ior);
  expect_same(one.errors.l1, other.errors.l1);
  expect_same(one.errors.relative_l1, other.errors.relative_l1);
  expect_same(one.errors.relative_l1_80, other.errors.relative_l1_80);
  expect_same(one.errors.relative_l1_cosine, other.errors.relative_l1_cosine);
  EXPECT_EQ(one.converged, other.converged);
  EXPECT_EQ(one.certainty.starts, other.certainty.starts);
  EXPECT_EQ(one.certainty.agree, other.certainty.agree);
  EXPECT_EQ(one.certainty.spread, other.certainty.spread);
  EXPECT_EQ(one.warnings, other.warnings);
  ASSERT_EQ(one.stages.size(), other.stages.size());
  for (std::size_t i = 0; i < one.stages.size(); ++i) {
    EXPECT_EQ(one.stages[i].error, other.stages[i].error);
    EXPECT_EQ(one.stages[i].iterations, other.stages[i].iterations);
    EXPECT_EQ(one.stages[i].samples, other.stages[i].samples);
    EXPECT_EQ(one.stages[i].touched, other.stages[i].touched);
  }
}

class EveryNorm : public ::testing::TestWithParam<Norm> {};
INSTANTIATE_TEST_SUITE_P(Norms, EveryNorm,
                         ::testing::Values(Norm::l1, Norm::cosine_l1, Norm::l2, Norm::log_l2));

void expect_same_by_threads(const Measurement& measurement, FitOptions options) {
  options.threads = 1;
  const Fit one = fit_of(measurement, options);
  for (const int threads : {2, 4}) {
    SCOPED_TRACE(std::to_string(threads) + " threads");
    options.threads = threads;
    expect_same(one, fit_of(measurement, options));
  }
}

// Every norm has a loop of its own, of whole tables and of damaged ones alike; what threads share
// out is the runs of a pass, the starts, the rows of the error figures and, where every channel has
// its exponent, three groups a run. So each of these is met once.
TEST_P(EveryNorm, HasTheSameBitsForAnyNumberOfThreads) {
  expect_same_by_threads(sample(), {.norm = GetParam()});
}

TEST(SeparateChannelsOfADamagedTable, HaveTheSameBitsForAnyNumberOfThreads) {
  expect_same_by_threads(damaged_sample(), {.separate_channels = true});
}

class KernelVersions : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!has_avx2()) GTEST_SKIP() << "the processor has no AVX2, so there is one version alone";
  }
};

TEST_F(KernelVersions, AgreeOnAPass) {
  for (const Norm norm : {Norm::l1, Norm::cosine_l1, Norm::l2, Norm::log_l2}) {
    FitOptions options;
    options.norm = norm;
    const Samples samples = all_samples(sample(), options);
    const Variables variables(options.kind, true, false);
    VectorXd x(9);
    x << 0.7, 0.4, 0.5, 3.1, 2.5, 1.9, 2.5, 0.4, -0.5;
    const auto pass = [&] {
      return Evaluation(Objective(samples, variables, norm, 0.1, 2).evaluate(x, Curvature::newton));
    };
    const Evaluation fast = pass();
    const BaselineInstructions baseline;
    const Evaluation slow = pass();
    // Fused multiply-adds round once instead of twice; 10^6 roundings of one sign would make 1e-10,
    // as they come they make far less.
    EXPECT_NEAR(fast.value, slow.value, 1e-12 * slow.value);
    EXPECT_NEAR(fast.true_value, slow.true_value, 1e-12 * slow.true_value);
    const VectorXd scale = slow.hessian.diagonal().cwiseAbs().cwiseSqrt();
    const Eigen::MatrixXd off = scale.cwiseInverse().asDiagonal() * (fast.hessian - slow.hessian) *
                                scale.cwiseInverse().asDiagonal();
    EXPECT_LT(off.cwiseAbs().maxCoeff(), 1e-11);
    // The sums of a gradient cancel: its parts are as large as the root of F times the matrix's.
    EXPECT_LT((fast.gradient - slow.gradient).cwiseQuotient(scale).norm(),
              1e-12 * std::sqrt(slow.value));
  }
}

TEST_F(KernelVersions, AgreeOnAWholeFit) {
  for (const Measurement* measurement : {&sample(), &damaged_sample()}) {
    const Fit fast = fit_of(*measurement, {});
    const BaselineInstructions baseline;
    const Fit slow = fit_of(*measurement, {});
    EXPECT_NEAR(fast.errors.relative_l1.pooled, slow.errors.relative_l1.pooled, 1e-6);
    // At a minimum an error of 1e-6 leaves the parameters free by a few times its root.
    const Parameters &a = fast.parameters, &b = slow.parameters;
    EXPECT_LT((a.diffuse / b.diffuse - 1).abs().maxCoeff(), 5e-3);
    EXPECT_LT((a.specular / b.specular - 1).abs().maxCoeff(), 5e-3);
    EXPECT_LT((a.exponent / b.exponent - 1).abs().maxCoeff(), 5e-3);
    EXPECT_NEAR(a.interpolation, b.interpolation, 5e-3);
    EXPECT_NEAR(*a.ior, *b.ior, 5e-3 * *b.ior);
  }
}

}  // namespace
}  // namespace lobefit
