// The objective against the model as the paper writes it, in long double: its value, and its
// derivatives by differences, inside and at the bounds.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <ostream>
#include <string>
#include <vector>

#include "fitting/objective.h"
#include "fitting/samples.h"
#include "fitting/variables.h"
#include "reflectance/abc.h"

namespace lobefit {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Real = long double;
using RealVector = std::vector<Real>;

constexpr double smoothing = 0.1;

Real fresnel(Real cosine, Real ior) {
  const Real transmitted = std::sqrt(1 - (1 - cosine * cosine) / (ior * ior));
  const Real s = (cosine - ior * transmitted) / (cosine + ior * transmitted);
  const Real p = (ior * cosine - transmitted) / (ior * cosine + transmitted);
  return (s * s + p * p) / 2;
}

// The three models with Fresnel and a shared exponent.
struct Model {
  ModelKind kind;
  Specular specular;
  Variables variables{kind, true, false, specular};

  Real lobe(const RealVector& x, Real u_phong, Real u_blinn) const {
    const Real s = std::exp(x[6]);
    const bool peak = specular == Specular::peak;
    const auto power = [](Real u, Real exponent) {
      return u < 1 ? std::exp(exponent * std::log1p(-u)) : 0;
    };
    switch (kind) {
      case ModelKind::modified_phong:
        return (peak ? 1 : (s + 2) / (2 * static_cast<Real>(pi))) * power(u_phong, s);
      case ModelKind::modified_blinn_phong:
        return (peak ? 1 : (s + 8) / (8 * static_cast<Real>(pi))) * power(u_blinn, s / 4);
      case ModelKind::interpolated:
        break;
    }
    return power((1 - x[7]) * u_phong + x[7] * u_blinn, s);
  }

  // F of the norm l1.
  Real value(const Samples& samples, const RealVector& x) const {
    Real sum = 0;
    for (const Samples::Run& run : samples.runs) {
      const Real ior = 1 + std::exp(x.back());
      const Real reflected =
          fresnel(run.cos_theta_d, ior) / (specular == Specular::peak ? fresnel(1, ior) : 1);
      for (std::size_t i = run.begin; i < run.end; ++i) {
        if (!(samples.weight[i] > 0)) continue;
        const Real g = reflected * lobe(x, samples.u_phong[i], samples.u_blinn[i]);
        for (std::size_t c = 0; c < 3; ++c) {
          for (const auto& half : samples.measured[c]) {
            const Real r = (x[c] + x[3 + c] * g - static_cast<Real>(half[i])) / smoothing;
            sum += samples.weight[i] * 2 * smoothing * smoothing * (std::sqrt(1 + r * r) - 1);
          }
        }
      }
    }
    return sum;
  }
};

struct Point {
  std::string name;
  ModelKind kind = ModelKind::interpolated;
  std::function<void(VectorXd&)> move;  // from a point inside
  Specular specular = Specular::coefficient;
};

// GoogleTest would print the bytes, those between the members too, which nobody has written.
void PrintTo(const Point& point, std::ostream* out) { *out << point.name; }

VectorXd variables_at(const Point& point) {
  const bool interpolated = point.kind == ModelKind::interpolated;
  VectorXd x(interpolated ? 9 : 8);
  x.head<7>() << 0.7, 0.4, 0.5, 3.1, 2.5, 1.9, 2.5;
  if (interpolated) x[7] = 0.4;
  x[x.size() - 1] = -0.5;
  point.move(x);
  return x;
}

// k_s that keeps k_s R_F where it was.
void with_excess_ior(VectorXd& x, double excess) {
  const auto at_normal = [&] {
    const double eta_less_1 = std::exp(x[x.size() - 1]);
    return std::pow(eta_less_1 / (eta_less_1 + 2), 2);
  };
  const double before = at_normal();
  x[x.size() - 1] = std::log(excess);
  x.segment<3>(Variables::specular) *= before / at_normal();
}

std::vector<Point> points() {
  const auto set = [](int i, double value) { return [=](VectorXd& x) { x[i] = value; }; };
  // A peak of about the k_s R_F of the other points.
  const auto as_bright = [](VectorXd& x) { x.segment<3>(Variables::specular) *= 0.05; };
  const auto peak_at = [=](double excess) {
    return [=](VectorXd& x) {
      as_bright(x);
      x[8] = std::log(excess);
    };
  };
  const ModelKind phong = ModelKind::modified_phong, blinn = ModelKind::modified_blinn_phong;
  const ModelKind both = ModelKind::interpolated;
  return {{"inside", both, [](VectorXd&) {}},
          {"phong inside", phong, [](VectorXd&) {}},
          {"blinn-phong inside", blinn, [](VectorXd&) {}},
          {"alpha = 0", both, set(7, 0)},
          {"alpha = 1", both, set(7, 1)},
          {"s at its floor", both, set(6, std::log(1e-4))},
          {"phong, s at its floor", phong, set(6, std::log(1e-4))},
          {"s = 1e5", both, set(6, std::log(1e5))},
          {"eta near 1", both, [](VectorXd& x) { with_excess_ior(x, 1e-4); }},
          {"eta = 200", both, [](VectorXd& x) { with_excess_ior(x, 199); }},
          {"k_s = 0", both, [](VectorXd& x) { x.segment<3>(3).setZero(); }},
          {"rho_d = 0", both, [](VectorXd& x) { x.head<3>().setZero(); }},
          {"peak inside", both, as_bright, Specular::peak},
          {"peak of phong", phong, as_bright, Specular::peak},
          {"peak of blinn-phong", blinn, as_bright, Specular::peak},
          {"peak, eta near 1", both, peak_at(1e-4), Specular::peak},
          {"peak, eta = 200", both, peak_at(199), Specular::peak}};
}

class EveryPoint : public ::testing::TestWithParam<Point> {
 protected:
  EveryPoint()
      : model_{GetParam().kind, GetParam().specular},
        x_(variables_at(GetParam())),
        samples_(subsample(all_samples(sample_measurement("violet-rubber"), {}), 500)) {
    // Where the lobe ends the objective has an edge (for s near 0 a step), which differences see.
    const double alpha = GetParam().kind == ModelKind::modified_phong         ? 0
                         : GetParam().kind == ModelKind::modified_blinn_phong ? 1
                                                                              : x_[7];
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      const double u = (1 - alpha) * samples_.u_phong[i] + alpha * samples_.u_blinn[i];
      if (std::abs(1 - u) < 0.01) samples_.weight[i] = 0;
    }
    at_ = Objective(samples_, model_.variables, Norm::l1, smoothing, 1)
              .evaluate(x_, Curvature::newton);
  }

  // F with the variables i and j moved by so many steps; the formulas hold beyond the bounds too.
  Real moved(double step, int i, int steps_i, int j = 0, int steps_j = 0) const {
    RealVector x(x_.data(), x_.data() + x_.size());
    x[static_cast<std::size_t>(i)] += steps_i * size(step, i);
    x[static_cast<std::size_t>(j)] += steps_j * size(step, j);
    return model_.value(samples_, x);
  }

  double size(double step, int i) const { return step * std::max(1.0, std::abs(x_[i])); }

  const Model model_;
  const VectorXd x_;
  Samples samples_;
  Evaluation at_;
};

INSTANTIATE_TEST_SUITE_P(Points, EveryPoint, ::testing::ValuesIn(points()),
                         [](const auto& point) { return "at_" + std::to_string(point.index); });

TEST_P(EveryPoint, HasTheValueOfTheFormulas) {
  const Real value = moved(0, 0, 0);
  EXPECT_NEAR(at_.value, static_cast<double>(value), 1e-12 * at_.value) << GetParam().name;
}

TEST_P(EveryPoint, HasTheGradientOfDifferences) {
  constexpr double step = 1e-4;
  for (int i = 0; i < x_.size(); ++i) {
    const Real slope =
        (8 * (moved(step, i, 1) - moved(step, i, -1)) - (moved(step, i, 2) - moved(step, i, -2))) /
        (12 * size(step, i));
    // Fourth order: the step to the fourth, of some 30 times as fast a change as of x itself.
    EXPECT_NEAR(at_.gradient[i], static_cast<double>(slope / 2),
                1e-8 * std::abs(at_.gradient[i]) + 1e-10 * at_.value / size(1, i))
        << GetParam().name << ", variable " << i;
  }
}

TEST_P(EveryPoint, HasTheMatrixOfDifferences) {
  constexpr double step = 4e-5;
  const VectorXd diagonal = at_.hessian.diagonal().cwiseAbs();
  for (int i = 0; i < x_.size(); ++i) {
    for (int j = 0; j <= i; ++j) {
      const Real change = i == j
                              ? (16 * (moved(step, i, 1) + moved(step, i, -1)) -
                                 (moved(step, i, 2) + moved(step, i, -2)) - 30 * moved(0, i, 0)) /
                                    12
                              : (moved(step, i, 1, j, 1) - moved(step, i, 1, j, -1) -
                                 moved(step, i, -1, j, 1) + moved(step, i, -1, j, -1)) /
                                    4;
      const double area = size(step, i) * size(step, j);
      // The squared step, of a change some 80 times as fast as of x; and what summing in long
      // double leaves of F, over the squared step.
      const double typical = std::sqrt(diagonal[i] * diagonal[j]);
      EXPECT_NEAR(at_.hessian(i, j), static_cast<double>(change / (2 * area)),
                  1e-5 * typical + 3e-18 * at_.value / area)
          << GetParam().name << ", variables " << i << " and " << j;
    }
  }
}

}  // namespace
}  // namespace lobefit
