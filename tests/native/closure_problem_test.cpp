#include "closures/closure_problem.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

#include "closures/band_matrix.h"
#include "measurement/instructions.h"

namespace lobefit {
namespace {

// Three closures, one of each kind that matters: sharp and bent, wide, and of the other
// distribution.
ClosureCurves closures_of(int coefficients) {
  ClosureCurves closures{{3}, {Distribution::ggx, Distribution::beckmann, Distribution::ggx}, {}};
  const ClosureLayout& layout = closures.layout;
  closures.x.setConstant(layout.curves(), coefficients, 0.2);
  const double means[] = {-3, -1.2, -0.6}, spreads[] = {0.4, -0.3, 0.1}, bends[] = {0.3, -0.2, 0};
  for (int k = 0; k < layout.specular; ++k) {
    closures.x.row(layout.shape(k, ClosureLayout::mean)).setConstant(means[k]);
    closures.x.row(layout.shape(k, ClosureLayout::spread)).setConstant(spreads[k]);
    closures.x.row(layout.shape(k, ClosureLayout::bend)).setConstant(bends[k]);
  }
  std::mt19937 random(3);
  std::uniform_real_distribution<double> part(0.9, 1.1);
  for (double& value : closures.x.reshaped()) value *= part(random);
  return closures;
}

Target target() {
  return thinned(sample_target([](const Vector3& wi, const Vector3& wo) -> Rgb {
                   const double above = (wi + wo).normalized().z();
                   return Rgb(0.1, 0.2, 0.15) + std::pow(above, 40) * Rgb(2, 1, 0.5);
                 }),
                 9, 3);
}

// smooth_error, light by light.
double plain_error(const Target& target, const ClosureCurves& closures, double smoothing) {
  const ClosureLayout& layout = closures.layout;
  double sum = 0;
  for (const TargetView& view : target) {
    for (const TargetLight& light : view.lights) {
      for (int c = 0; c < 3; ++c) {
        const auto weight = [&](int k) { return closures.at(layout.weight(k, c), view.wo.z()); };
        double r = weight(layout.specular) * light.wi.z() / pi - light.reflected[c];
        for (int k = 0; k < layout.specular; ++k) {
          const Microfacet closure(closures.distributions[static_cast<std::size_t>(k)],
                                   shape_at(closures, k, view.wo.z()), view.wo);
          r += weight(k) * closure.evaluate(light.wi, light.half);
        }
        const double e = smoothing * light.typical;
        sum += light.weight * (std::sqrt(r * r + e * e) - e);
      }
    }
  }
  return sum;
}

TEST(ClosureProblem, ErrorIsThatOfAPlainLoop) {
  const ClosureCurves closures = closures_of(1);  // constants have no stiffness
  const double expected = plain_error(target(), closures, 0.1);
  // The exponential of the lanes and the order of sums round otherwise.
  EXPECT_NEAR(smooth_error(in_columns(target()), closures, 0.1), expected, 1e-12 * expected);
}

TEST(ClosureProblem, DescendsUntilNoWeightCanBeMovedForTheBetter) {
  ClosureCurves closures = closures_of(ViewSplines::coarse);
  const SearchTarget views = in_columns(target());
  const Monitor monitor;
  const ClosureCurves found = descend(views, closures, 0.3, 200, monitor);
  const double error = smooth_error(views, found, 0.3);
  EXPECT_LT(error, 0.3 * smooth_error(views, closures, 0.3));
  const ClosureLayout& layout = found.layout;
  for (int curve = layout.weight(0, 0); curve < layout.curves(); ++curve) {
    for (const double factor : {0.98, 1.02}) {
      ClosureCurves moved = found;
      moved.x.row(curve) *= factor;
      // descend ends where an iteration gains less than a ten-thousandth, in a flat valley a little
      // early. A weight that is 2 % off where it matters costs more.
      EXPECT_GT(smooth_error(views, moved, 0.3), error * (1 - 3e-3)) << curve << ' ' << factor;
    }
  }
}

// What closures reflect of a white world at a view, light by light.
Rgb albedo_of(const ClosureCurves& closures, const TargetView& view) {
  const ClosureLayout& layout = closures.layout;
  const auto weights = [&](int k) -> Rgb {
    const auto of = [&](int c) { return closures.at(layout.weight(k, c), view.wo.z()); };
    return {of(0), of(1), of(2)};
  };
  Rgb albedo = Rgb::Zero();
  for (const TargetLight& light : view.lights) {
    Rgb reflected = weights(layout.specular) * light.wi.z() / pi;
    for (int k = 0; k < layout.specular; ++k) {
      const Microfacet closure(closures.distributions[static_cast<std::size_t>(k)],
                               shape_at(closures, k, view.wo.z()), view.wo);
      reflected += weights(k) * closure.evaluate(light.wi, light.half);
    }
    albedo += light.solid_angle * reflected;
  }
  return albedo;
}

Rgb albedo_of(const TargetView& view) {
  Rgb albedo = Rgb::Zero();
  for (const TargetLight& light : view.lights) albedo += light.solid_angle * light.reflected;
  return albedo;
}

// The target, of which closures may reflect so much in each channel.
SearchTarget limited(const Target& target, const Rgb& part) {
  SearchTarget views = in_columns(target);
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Rgb albedo = albedo_of(target[i]);
    views[i].limits = ViewLimits{albedo.maxCoeff(), part * albedo, true};
  }
  return views;
}

TEST(ClosureProblem, KeepsNearlyToWhatMayBeReflected) {
  const Target whole = target();
  const Monitor monitor;
  const Rgb part(1.2, 0.5, 1.2);
  const ClosureCurves start =
      descend(in_columns(whole), closures_of(ViewSplines::coarse), 0.3, 200, monitor);
  const ClosureCurves found = descend(limited(whole, part), start, 0.3, 200, monitor);
  Rgb free = Rgb::Zero(), kept = Rgb::Zero(), all = Rgb::Zero();
  for (const TargetView& view : whole) {
    free += albedo_of(start, view);
    kept += albedo_of(found, view);
    all += albedo_of(view);
  }
  // Half of the green is half of all light: lowering it gains as much as a limit that is exceeded
  // by a twentieth costs. Where less is reflected than may be, it counts for nothing; but all
  // channels share the shapes, which change.
  EXPECT_NEAR(kept[1] / all[1], 0.55, 0.05);
  EXPECT_NEAR(kept[0] / free[0], 1, 0.1);
  EXPECT_NEAR(kept[2] / free[2], 1, 0.1);
  EXPECT_NEAR(free[1] / all[1], 1, 0.05);
}

TEST(ClosureProblem, HasTheSameBitsInBothVersions) {
  if (!has_avx2()) GTEST_SKIP() << "the processor has no AVX2, so there is one version alone";
  const SearchTarget views = limited(target(), Rgb(0.8, 0.8, 0.8));
  const Monitor monitor;
  const ClosureCurves fast = descend(views, closures_of(ViewSplines::coarse), 0.1, 5, monitor);
  const BaselineInstructions baseline;
  const ClosureCurves slow = descend(views, closures_of(ViewSplines::coarse), 0.1, 5, monitor);
  EXPECT_TRUE(fast.x == slow.x);
  EXPECT_EQ(smooth_error(views, fast, 0.1), smooth_error(views, slow, 0.1));
}

TEST(BandMatrix, SolvesAsADenseOneDoes) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> part(-1, 1);
  for (const Eigen::Index size : {1, 3, 40}) {
    for (const Eigen::Index band : {0, 2, 7, 60}) {
      BandMatrix matrix(size, band);
      Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(size, size);
      for (Eigen::Index j = 0; j < size; ++j) {
        for (Eigen::Index i = j; i <= std::min(j + matrix.band(), size - 1); ++i) {
          matrix(i, j) = dense(i, j) = i == j ? 20 : part(random);
        }
      }
      const Eigen::VectorXd b = Eigen::VectorXd::NullaryExpr(size, [&] { return part(random); });
      const Eigen::VectorXd expected = dense.selfadjointView<Eigen::Lower>().ldlt().solve(b);
      // The diagonal makes the matrix well conditioned.
      EXPECT_LT((matrix.solve_in_place(b) - expected).norm(), 1e-14) << size << ' ' << band;
    }
  }
}

}  // namespace
}  // namespace lobefit
