#include "fitting/objective.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <ostream>
#include <random>
#include <vector>

#include "fitting/compressed_cost.h"
#include "fitting/samples.h"
#include "reflectance/abc.h"
#include "reflectance/fresnel.h"

namespace lobefit {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Case {
  ModelKind kind;
  bool fresnel;
  bool separate_channels;
  Norm norm;
};

// GoogleTest would print the bytes, those between the members too, which nobody has written.
void PrintTo(const Case& c, std::ostream* out) {
  *out << name_of(c.kind) << (c.fresnel ? ", Fresnel" : "")
       << (c.separate_channels ? ", separate channels, " : ", ") << name_of(c.norm);
}

const Measurement& table() {
  static const Measurement sample = sample_measurement("violet-rubber");
  return sample;
}

// A point inside all bounds, where every term of the model counts.
VectorXd inside(const Variables& variables) {
  VectorXd x(variables.count());
  x.head<6>() << 0.7, 0.4, 0.5, 3.1, 2.5, 1.9;
  for (int i = 0; i < variables.exponents(); ++i) x[6 + i] = 2.5 + 0.3 * i;
  if (variables.interpolation() >= 0) x[variables.interpolation()] = 0.4;
  if (variables.log_excess_ior() >= 0) x[variables.log_excess_ior()] = -0.5;
  return x;
}

class EveryObjective : public ::testing::TestWithParam<Case> {
 protected:
  EveryObjective() : variables_(GetParam().kind, GetParam().fresnel, GetParam().separate_channels) {
    FitOptions options;
    options.kind = GetParam().kind;
    options.fresnel = GetParam().fresnel;
    options.norm = GetParam().norm;
    samples_ = subsample(all_samples(table(), options), 3000);
  }

  Evaluation evaluate(const VectorXd& x) const {
    return Objective(samples_, variables_, GetParam().norm, smoothing, 1).evaluate(x);
  }

  // The model, and its derivatives by differences, at a sample and channel.
  double model(const VectorXd& x, std::size_t i, double cos_theta_d, int channel) const {
    const Parameters p = as_interpolated(variables_.to_parameters(x, 1));
    const double fresnel = p.ior ? fresnel_reflectance(cos_theta_d, *p.ior).value : 1;
    const double u =
        (1 - p.interpolation) * samples_.u_phong[i] + p.interpolation * samples_.u_blinn[i];
    const double lobe = u < 1 ? std::pow(1 - u, p.exponent[channel]) : 0;
    const double value = p.diffuse[channel] / pi + p.specular[channel] * fresnel * lobe;
    return GetParam().norm == Norm::log_l2 ? std::log(value + log_offset) : value;
  }

  static constexpr double smoothing = 0.1;
  Variables variables_;
  Samples samples_;
};

INSTANTIATE_TEST_SUITE_P(
    Cases, EveryObjective,
    ::testing::Values(Case{ModelKind::interpolated, true, false, Norm::l1},
                      Case{ModelKind::interpolated, false, false, Norm::l1},
                      Case{ModelKind::modified_phong, true, false, Norm::l1},
                      Case{ModelKind::modified_blinn_phong, true, true, Norm::l1},
                      Case{ModelKind::interpolated, true, true, Norm::l1},
                      Case{ModelKind::interpolated, true, false, Norm::cosine_l1},
                      Case{ModelKind::interpolated, true, false, Norm::l2},
                      Case{ModelKind::interpolated, true, true, Norm::log_l2}));

TEST_P(EveryObjective, HasTheValueOfAPlainLoop) {
  const VectorXd x = inside(variables_);
  double value = 0, true_value = 0;
  const bool linear = GetParam().norm == Norm::l1 || GetParam().norm == Norm::cosine_l1;
  for (const Samples::Run& run : samples_.runs) {
    for (std::size_t i = run.begin; i < run.end; ++i) {
      for (int c = 0; c < 3; ++c) {
        for (int half = 0; half < 2; ++half) {
          const double r = model(x, i, run.cos_theta_d, c) - samples_.measured[c][half][i];
          const double weight = samples_.weight[i];
          const double e2 = smoothing * smoothing;
          value += weight * (linear ? 2 * e2 * (std::sqrt(1 + r * r / e2) - 1) : r * r);
          true_value += weight * (linear ? std::abs(r) : r * r);
        }
      }
    }
  }
  const Evaluation at = evaluate(x);
  // The same sums in another order: rounding over some 10^4 terms.
  EXPECT_NEAR(at.value, value, 1e-12 * value);
  EXPECT_NEAR(at.true_value, true_value, 1e-12 * true_value);
}

TEST_P(EveryObjective, HasTheGradientOfItsDifferences) {
  const VectorXd x = inside(variables_);
  const Evaluation at = evaluate(x);
  for (int i = 0; i < x.size(); ++i) {
    VectorXd more = x, less = x;
    const double step = 1e-5 * std::max(1.0, std::abs(x[i]));
    more[i] += step;
    less[i] -= step;
    const double slope = (evaluate(more).value - evaluate(less).value) / (4 * step);
    // Rounding of the value over the step: 1e-16 / 1e-5; curvature: the squared step.
    EXPECT_NEAR(at.gradient[i], slope, 1e-6 * std::abs(slope) + 1e-9 * at.value)
        << "variable " << i;
  }
}

TEST_P(EveryObjective, HasTheMatrixOfReweightedSquares) {
  const VectorXd x = inside(variables_);
  const auto n = static_cast<Eigen::Index>(x.size());
  MatrixXd expected = MatrixXd::Zero(n, n);
  const bool linear = GetParam().norm == Norm::l1 || GetParam().norm == Norm::cosine_l1;
  for (const Samples::Run& run : samples_.runs) {
    for (std::size_t i = run.begin; i < run.end; ++i) {
      if (!(samples_.weight[i] > 0)) continue;
      for (int c = 0; c < 3; ++c) {
        VectorXd slope(n);
        for (Eigen::Index v = 0; v < n; ++v) {
          VectorXd more = x, less = x;
          more[v] += 1e-5;
          less[v] -= 1e-5;
          slope[v] =
              (model(more, i, run.cos_theta_d, c) - model(less, i, run.cos_theta_d, c)) / 2e-5;
        }
        const MatrixXd square = samples_.weight[i] * slope * slope.transpose();
        for (int half = 0; half < 2; ++half) {
          const double r = model(x, i, run.cos_theta_d, c) - samples_.measured[c][half][i];
          // rho'(r) / (2 r) of rho = 2 e^2 (root - 1).
          expected += square / (linear ? std::hypot(1, r / smoothing) : 1);
        }
      }
    }
  }
  // Slopes by central differences are known to about 1e-9.
  EXPECT_LT((evaluate(x).hessian - expected).norm(), 1e-6 * expected.norm());
}

TEST_P(EveryObjective, HasTheMatrixOfNewton) {
  const Objective objective(samples_, variables_, GetParam().norm, smoothing, 1);
  const VectorXd x = inside(variables_);
  const MatrixXd hessian = objective.evaluate(x, Curvature::newton).hessian;
  MatrixXd expected = evaluate(x).hessian;
  // Logarithms keep the matrix of Gauss and Newton.
  for (Eigen::Index v = 0; v < x.size() && GetParam().norm != Norm::log_l2; ++v) {
    VectorXd more = x, less = x;
    more[v] += 1e-5;
    less[v] -= 1e-5;
    expected.col(v) = (evaluate(more).gradient - evaluate(less).gradient) / 2e-5;
  }
  // Columns differ by many orders; differences are known to about 1e-9 of the gradient.
  const VectorXd scale = hessian.diagonal().cwiseAbs().cwiseSqrt().cwiseInverse();
  const MatrixXd off = scale.asDiagonal() * (hessian - expected) * scale.asDiagonal();
  EXPECT_LT(off.cwiseAbs().maxCoeff(), 1e-5);
}

TEST(Objective, HasTheSameBitsForAnyNumberOfThreads) {
  const FitOptions options;
  const Samples samples = all_samples(table(), options);
  const Variables variables(options.kind, true, false);
  const VectorXd x = inside(variables);
  const Evaluation one = Objective(samples, variables, Norm::l1, 0.1, 1).evaluate(x);
  for (const int threads : {2, 3, 8}) {
    const Evaluation many = Objective(samples, variables, Norm::l1, 0.1, threads).evaluate(x);
    EXPECT_EQ(one.value, many.value);
    EXPECT_EQ(one.gradient, many.gradient);
    EXPECT_EQ(one.hessian, many.hessian);
  }
}

TEST(Objective, IsFiniteOnEveryBound) {
  const FitOptions options;
  const Samples samples = subsample(all_samples(table(), options), 2000);
  const Variables variables(options.kind, true, false);
  for (int i = 0; i < variables.count(); ++i) {
    for (const double bound : {variables.lower()[i], variables.upper()[i]}) {
      if (bound > 1e30) continue;  // reflectances have no upper bound
      VectorXd x = inside(variables);
      x[i] = bound;
      const Evaluation at = Objective(samples, variables, Norm::l1, 0.1, 1).evaluate(x);
      EXPECT_TRUE(std::isfinite(at.value) && at.gradient.allFinite() && at.hessian.allFinite())
          << "variable " << i << " at " << bound;
    }
  }
}

class CompressedCostTest : public testing::Test {
 protected:
  const FitOptions options{};
  const Samples samples = subsample(all_samples(table(), options), 2000);
  const Variables variables{options.kind, true, false};
  const Objective objective{samples, variables, Norm::l1, 0.1, 1};
  const VectorXd x = inside(variables);  // alpha = 0.4
  const Monitor monitor{};
  NewtonPause pause;
};

TEST_F(CompressedCostTest, HasValueGradientAndMatrixOfTheObjective) {
  const std::vector<int> free = {3, 4, 5, 6, 7};
  const CompressedCost cost(objective, free, x, pause, monitor);
  const VectorXd values = x(free);
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> jacobian(6, 5);
  VectorXd residuals(6);
  const double* parameters[] = {values.data()};
  double* jacobians[] = {jacobian.data()};
  ASSERT_TRUE(cost.Evaluate(parameters, residuals.data(), jacobians));
  const Evaluation& at = objective.evaluate(x);
  const VectorXd gradient = at.gradient(free);
  const MatrixXd hessian = at.hessian(free, free);
  EXPECT_NEAR(residuals.squaredNorm(), at.value, 1e-12 * at.value);
  EXPECT_LT((jacobian.transpose() * residuals - gradient).norm(), 1e-9 * gradient.norm());
  // Newton's matrix where a sum of squares can have it, that of reweighted squares elsewhere; the
  // diagonal is raised by 1e-12 so that a variable without effect does no harm.
  const MatrixXd newton = objective.evaluate(x, Curvature::newton).hessian(free, free);
  const double reached = gradient.dot(newton.ldlt().solve(gradient));
  const bool definite = Eigen::LLT<MatrixXd>(newton).info() == Eigen::Success;
  const MatrixXd expected = definite && reached <= at.value ? newton : hessian;
  EXPECT_LT((jacobian.transpose() * jacobian - expected).norm(), 1e-11 * expected.norm());
}

// Also where the solver would not have taken it.
TEST_F(CompressedCostTest, KnowsTheBestPointThatItWasAskedAbout) {
  const CompressedCost cost(objective, {0, 1}, x, pause, monitor);
  const double points[][2] = {{x[0], x[1]}, {2 * x[0], 2 * x[1]}, {0.5 * x[0], 0.5 * x[1]}};
  double least = std::numeric_limits<double>::infinity();
  VectorXd residuals(3);
  for (const auto& point : points) {
    const double* parameters[] = {point};
    ASSERT_TRUE(cost.Evaluate(parameters, residuals.data(), nullptr));
    least = std::min(least, residuals.squaredNorm());
  }
  EXPECT_NEAR(objective.evaluate(cost.best()).value, least, 1e-9 * least);
  EXPECT_GT(residuals.squaredNorm(), 1.001 * least);
}

TEST_F(CompressedCostTest, CutsAStepAtTheBoundThatItMeets) {
  const CompressedCost cost(objective, {3, variables.interpolation()}, x, pause, monitor);
  const double beyond[] = {x[3] + 2, 1.6};
  EXPECT_TRUE(cost.left_bounds(beyond));
  VectorXd expected = x;
  expected[3] += 1;
  expected[variables.interpolation()] = 1;
  EXPECT_LT((cost.within_bounds(beyond) - expected).norm(), 1e-12);
  EXPECT_EQ(cost.within_bounds(beyond)[variables.interpolation()], 1);
  const double* parameters[] = {beyond};
  VectorXd residuals(3);
  ASSERT_TRUE(cost.Evaluate(parameters, residuals.data(), nullptr));
  EXPECT_NEAR(residuals.squaredNorm(), objective.evaluate(expected).value,
              1e-9 * residuals.squaredNorm());
  const double inside_bounds[] = {x[3] + 2, 0.9};
  EXPECT_FALSE(cost.left_bounds(inside_bounds));
}

TEST(Samples, KeepBothMeasuredValuesOfAPair) {
  const FitOptions options;
  const Samples samples = all_samples(table(), options);
  double weight = 0;
  for (const float w : samples.weight) weight += w;
  EXPECT_EQ(2 * weight, table().bins().valid);
  for (const Samples::Run& run : samples.runs) EXPECT_EQ((run.end - run.begin) % 4, 0u);
}

TEST(Samples, OfASubsampleWeighAsMuchAsAll) {
  const FitOptions options;
  const Samples all = all_samples(table(), options), some = subsample(all, 10000);
  double weight = 0, expected = 0, mass = 0, expected_mass = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    expected += all.weight[i];
    expected_mass += all.weight[i] * all.measured[1][0][i];
  }
  for (std::size_t i = 0; i < some.size(); ++i) {
    weight += some.weight[i];
    mass += some.weight[i] * some.measured[1][0][i];
  }
  EXPECT_LT(some.size(), 11000u);
  // Systematic sampling of 10^4 has a relative error well below 10^-2.
  EXPECT_NEAR(weight, expected, 0.01 * expected);
  EXPECT_NEAR(mass, expected_mass, 0.01 * expected_mass);
}

}  // namespace
}  // namespace lobefit
