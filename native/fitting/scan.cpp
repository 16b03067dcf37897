#include "fitting/scan.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "fitting/objective.h"
#include "fitting/parallel.h"

namespace lobefit {
namespace {

using Eigen::VectorXd;

// Log s from .1 to 3e5 in quarters of a decade; alpha; eta - 1 from a weak dielectric to a metal.
constexpr int exponent_steps = 27;
constexpr std::array<double, 5> interpolations = {0, 0.25, 0.5, 0.75, 1};
constexpr std::array<double, 4> excess_iors = {0.15, 0.5, 1.5, 6};

double log_exponent_at(int step) { return std::log(10) * (-1 + 0.25 * step); }

// The columns of the grid: one for every (alpha, eta) that the model has.
struct Grid {
  int interpolations_used, iors_used;
  int columns() const { return interpolations_used * iors_used; }
};

// Newton steps of the reweighted squares for rho_d and k_s, channel by channel; the smoothing
// falls from coarse to fine while they run.
double solve_reflectances(const Samples& samples, const Variables& variables, Norm norm,
                          VectorXd& x) {
  constexpr std::array<double, 5> smoothing = {0.5, 0.2, 0.1, 0.05, 0.03};
  Evaluation at;
  for (const double e : smoothing) {
    at = Objective(samples, variables, norm, e, 1).evaluate(x);
    for (int c = 0; c < 3; ++c) {
      const std::array<int, 2> dk = {Variables::diffuse + c, Variables::specular + c};
      Eigen::Matrix2d hessian = at.hessian(dk, dk);
      hessian.diagonal() *= 1 + 1e-9;
      const double determinant = hessian.determinant();
      if (!(determinant > 0)) continue;
      const Eigen::Vector2d step = hessian.inverse() * Eigen::Vector2d(at.gradient(dk));
      for (int i = 0; i < 2; ++i) x[dk[i]] = std::max(0.0, x[dk[i]] - step[i]);
    }
  }
  return at.true_value;
}

VectorXd shape_of(const Variables& variables, int step, int a, int e) {
  VectorXd x = VectorXd::Zero(variables.count());
  x.segment<3>(Variables::diffuse).setOnes();
  x.segment(Variables::log_exponent, variables.exponents()).setConstant(log_exponent_at(step));
  if (variables.interpolation() >= 0) x[variables.interpolation()] = interpolations[a];
  if (variables.log_excess_ior() >= 0) x[variables.log_excess_ior()] = std::log(excess_iors[e]);
  return x;
}

// The best of the sorted candidates, the best Phong (alpha = 0) and Blinn-Phong (alpha = 1) lobes
// always among them.
std::vector<Candidate> chosen(const std::vector<Candidate>& sorted, int interpolation,
                              std::size_t count) {
  std::vector<Candidate> result;
  bool seen[2] = {interpolation < 0, interpolation < 0};
  for (const Candidate& candidate : sorted) {
    bool first_of_its_kind = false;
    for (int kind = 0; kind < 2 && interpolation >= 0; ++kind) {
      if (candidate.x[interpolation] != kind || seen[kind]) continue;
      first_of_its_kind = seen[kind] = true;
    }
    const std::size_t reserved = (seen[0] ? 0 : 1) + (seen[1] ? 0 : 1);
    if (first_of_its_kind || result.size() + reserved < count) result.push_back(candidate);
  }
  return result;
}

}  // namespace

std::vector<Candidate> scan_shapes(const Samples& few, const Variables& variables, Norm norm,
                                   std::size_t count, int threads, const Monitor& monitor) {
  const Grid grid{variables.interpolation() >= 0 ? static_cast<int>(interpolations.size()) : 1,
                  variables.log_excess_ior() >= 0 ? static_cast<int>(excess_iors.size()) : 1};
  std::vector<Candidate> best(static_cast<std::size_t>(grid.columns()));
  parallel_for(grid.columns(), threads, [&](int column) {
    const int a = column % grid.interpolations_used, e = column / grid.interpolations_used;
    Candidate& least = best[static_cast<std::size_t>(column)];
    for (int step = 0; step < exponent_steps; ++step) {
      monitor.throw_if_cancelled();
      VectorXd x = shape_of(variables, step, a, e);
      const double value = solve_reflectances(few, variables, norm, x);
      if (step == 0 || value < least.true_value) least = {x, value};
    }
  });
  std::sort(best.begin(), best.end(), [](const Candidate& left, const Candidate& right) {
    return left.true_value < right.true_value;
  });
  return chosen(best, variables.interpolation(), count);
}

}  // namespace lobefit
