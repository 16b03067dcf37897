#include "fitting/minimise.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "fitting/compressed_cost.h"
#include "fitting/objective.h"

namespace lobefit {
namespace {

using Eigen::VectorXd;

// The free variables that can move: not those at a bound with the descent pointing outward.
std::vector<int> movable(const Variables& variables, const std::vector<int>& free,
                         const VectorXd& x, const VectorXd& gradient) {
  std::vector<int> result;
  for (const int i : free) {
    const bool held = (x[i] <= variables.lower()[i] && gradient[i] >= 0) ||
                      (x[i] >= variables.upper()[i] && gradient[i] <= 0);
    if (!held) result.push_back(i);
  }
  return result;
}

ceres::Solver::Options solver_options(const Precision& precision) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = precision.iterations;
  options.function_tolerance = precision.tolerance;
  options.gradient_tolerance = 0;
  options.parameter_tolerance = 1e-10;
  options.initial_trust_region_radius = 1e6;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  return options;
}

// Ends a solve whose step met a bound.
class StopAtBound final : public ceres::IterationCallback {
 public:
  StopAtBound(const CompressedCost& cost, const VectorXd& values) : cost_(cost), values_(values) {}

  ceres::CallbackReturnType operator()(const ceres::IterationSummary&) override {
    return cost_.left_bounds(values_.data()) ? ceres::SOLVER_TERMINATE_SUCCESSFULLY
                                             : ceres::SOLVER_CONTINUE;
  }

 private:
  const CompressedCost& cost_;
  const VectorXd& values_;
};

// Solves for the variables `moved`, to convergence or to the first bound that is met.
void solve(const Objective& objective, const std::vector<int>& moved, const Precision& precision,
           const Monitor& monitor, Minimum& minimum) {
  VectorXd values = minimum.x(moved);
  CompressedCost cost(objective, moved, minimum.x, minimum.pause, monitor);
  ceres::Problem::Options ownership;
  ownership.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(ownership);
  problem.AddResidualBlock(&cost, nullptr, values.data());
  StopAtBound stop_at_bound(cost, values);
  ceres::Solver::Options options = solver_options(precision);
  options.callbacks.push_back(&stop_at_bound);
  options.update_state_every_iteration = true;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  monitor.throw_if_cancelled();
  minimum.iterations += static_cast<int>(summary.iterations.size());
  minimum.converged = summary.termination_type == ceres::CONVERGENCE;
  minimum.x = cost.best();
}

// One level: solves, and again as long as variables meet their bounds or come free of them. Where
// the lobe is a ridge of s and k_s, or half of the values are spikes, every solve may use up its
// iterations and still gain: after so many in all the level is as good as it gets.
void solve_level(const Objective& objective, const std::vector<int>& free,
                 const Precision& precision, const Monitor& monitor, Minimum& minimum) {
  constexpr int max_rounds = 30, max_full_solves = 3;
  const int last_iteration = minimum.iterations + max_full_solves * precision.iterations;
  std::vector<int> moved;
  for (int round = 0; round < max_rounds && minimum.iterations < last_iteration; ++round) {
    monitor.throw_if_cancelled();
    const VectorXd gradient = objective.evaluate_slope(minimum.x, minimum.pause.next()).gradient;
    std::vector<int> now = movable(objective.variables(), free, minimum.x, gradient);
    minimum.converged |= now.empty();
    if (minimum.converged && (now.empty() || now == moved)) return;
    moved = std::move(now);
    solve(objective, moved, precision, monitor, minimum);
  }
}

bool has_smoothing(Norm norm) { return norm == Norm::l1 || norm == Norm::cosine_l1; }

// The smoothing of each level, the last the finest.
std::vector<double> levels(const Precision& precision, double mean_misfit) {
  constexpr double step = 4;
  std::vector<double> result = {precision.finest};
  while (result.front() * step <= precision.widest * mean_misfit) {
    result.insert(result.begin(), result.front() * step);
  }
  return result;
}

// Of each value, in units of the median reflectance.
double mean_misfit(const Samples& samples, const Variables& variables, const VectorXd& x,
                   int threads) {
  constexpr double smoothing = 1;  // which the true value does not have
  constexpr double values_of_a_sample = 6;
  const double weight = std::accumulate(samples.weight.begin(), samples.weight.end(), 0.0);
  const Objective objective(samples, variables, Norm::l1, smoothing, threads);
  const double mean =
      objective.evaluate(x, Curvature::newton).true_value / (values_of_a_sample * weight);
  return std::isfinite(mean) ? mean : 0;
}

}  // namespace

Precision coarse_precision() { return {1, 0.04, 1e-4, 100}; }
Precision fine_precision() { return {1, 0.01, 1e-7, 100}; }
Precision finishing_precision() { return {1.0 / 16, 0.01, 1e-6, 100}; }
Precision last_precision() { return {0, 0.01, 2e-6, 30}; }

Minimum minimise(const Samples& samples, const Variables& variables, Norm norm,
                 const std::vector<int>& free, const VectorXd& x, const Precision& precision,
                 int threads, const Monitor& monitor, NewtonPause pause) {
  constexpr double unknown = std::numeric_limits<double>::infinity();
  Minimum best{variables.clamp(x), unknown, unknown, 0, 0, false, pause};
  Minimum current = best;
  const bool wide = has_smoothing(norm) && precision.widest > 0;
  if (wide) ++current.passes;
  for (const double smoothing :
       levels(precision, wide ? mean_misfit(samples, variables, current.x, threads) : 0)) {
    const Objective objective(samples, variables, norm, smoothing, threads);
    current.converged = false;
    if (std::isinf(current.start_value)) {
      current.start_value = objective.evaluate_slope(current.x, current.pause.next()).true_value;
    }
    const double before = current.true_value;
    solve_level(objective, free, precision, monitor, current);
    current.true_value = objective.evaluate_slope(current.x, current.pause.next()).true_value;
    const double gain = best.true_value - current.true_value;
    if (gain > 0) best = current;
    current.passes += objective.passes();
    best.iterations = current.iterations;
    best.pause = current.pause;
    best.passes = current.passes;
    if (std::abs(before - current.true_value) < 1e-6 * best.true_value) break;
  }
  return best;
}

}  // namespace lobefit
