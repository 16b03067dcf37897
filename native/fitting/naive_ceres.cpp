#include "fitting/naive_ceres.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>

#include "fitting/minimise.h"
#include "fitting/variables.h"
#include "measurement/input_error.h"
#include "measurement/parallel.h"

namespace lobefit {
namespace {

constexpr int variable_count = 9;

// f - m of one channel of one bin, in units of the median reflectance. ceres::exp, log and sqrt are
// found for a ceres::Jet by its namespace.
class Misfit {
 public:
  Misfit(const LobeCoordinates& at, int channel, double measured)
      : at_(at), channel_(channel), measured_(measured) {}

  template <typename T>
  bool operator()(const T* x, T* misfit) const {
    using std::exp;
    using std::log;
    const T& alpha = x[7];
    const T base = 1.0 - (1.0 - alpha) * at_.u_phong - alpha * at_.u_blinn;
    *misfit = x[Variables::diffuse + channel_] - measured_;
    // pow of a base that is not positive would have no derivatives; the lobe is 0 there.
    if (base > 0.0) {
      const T power = exp(exp(x[Variables::log_exponent]) * log(base));
      *misfit += x[Variables::specular + channel_] * fresnel(exp(x[8])) * power;
    }
    return true;
  }

 private:
  // R_F by the index of refraction less 1; see reflectance/fresnel.h.
  template <typename T>
  T fresnel(const T& excess_ior) const {
    using std::sqrt;
    const double c = at_.cos_theta_d;
    const T excess = excess_ior * (excess_ior + 2.0);
    const T g = sqrt(excess + c * c);
    const T difference = excess / (g + c);
    const T s = difference / (g + c);
    const T ratio = (c * (g + c) - 1.0) / (c * difference + 1.0);
    return 0.5 * s * s * (1.0 + ratio * ratio);
  }

  LobeCoordinates at_;
  int channel_;
  double measured_;
};

class StopWhenCancelled final : public ceres::IterationCallback {
 public:
  explicit StopWhenCancelled(const Monitor& monitor) : monitor_(monitor) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary&) override {
    return monitor_.cancelled() ? ceres::SOLVER_ABORT : ceres::SOLVER_CONTINUE;
  }

 private:
  const Monitor& monitor_;
};

ceres::Problem::Options problem_options() {
  ceres::Problem::Options options;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.disable_all_safety_checks = true;
  return options;
}

ceres::Solver::Options solver_options(int threads) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  options.num_threads = threads;
  options.max_num_iterations = 100;
  options.logging_type = ceres::SILENT;
  return options;
}

}  // namespace

Samples samples_for_others(const Measurement& measurement, int bins, int threads) {
  if (bins < 0) throw InputError("bins: expected 0 (all of them) or more, found less.");
  Samples all = all_samples(measurement, {.threads = threads});
  if (bins == 0 || bins >= measurement.bins().valid) return all;
  constexpr int bins_of_a_sample = 2;
  return subsample(all, static_cast<std::size_t>(std::max(1, bins / bins_of_a_sample)),
                   thread_count(threads));
}

NaiveFit fit_naively(const Samples& samples, const Parameters& start, int threads,
                     const Monitor& monitor) {
  const auto began = std::chrono::steady_clock::now();
  const Variables variables(ModelKind::interpolated, true, false);
  Eigen::VectorXd x = variables.from_parameters(start, samples.unit);

  ceres::SoftLOneLoss loss(fine_precision().finest);
  std::deque<ceres::ScaledLoss> scaled;
  ceres::Problem problem(problem_options());
  problem.AddParameterBlock(x.data(), variable_count);
  for (int i = 0; i < variable_count; ++i) {
    problem.SetParameterLowerBound(x.data(), i, variables.lower()[i]);
    problem.SetParameterUpperBound(x.data(), i, variables.upper()[i]);
  }
  NaiveFit fit;
  for (const Samples::Run& run : samples.runs) {
    monitor.throw_if_cancelled();
    for (std::size_t i = run.begin; i < run.end; ++i) {
      const double weight = samples.weight[i];
      if (!(weight > 0)) continue;
      ceres::LossFunction* weighted = &loss;
      if (weight != 1) {
        weighted = &scaled.emplace_back(&loss, weight, ceres::DO_NOT_TAKE_OWNERSHIP);
      }
      const LobeCoordinates at{samples.u_phong[i], samples.u_blinn[i], run.cos_theta_d};
      for (std::size_t half = 0; half < 2; ++half) {
        for (std::size_t c = 0; c < 3; ++c) {
          auto* const cost = new ceres::AutoDiffCostFunction<Misfit, 1, variable_count>(
              new Misfit(at, static_cast<int>(c), samples.measured[c][half][i]));
          problem.AddResidualBlock(cost, weighted, x.data());
        }
        ++fit.bins;
      }
    }
  }

  StopWhenCancelled stop(monitor);
  ceres::Solver::Options options = solver_options(thread_count(threads));
  options.callbacks.push_back(&stop);
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  monitor.throw_if_cancelled();
  fit.parameters = variables.to_parameters(x, samples.unit);
  fit.iterations = static_cast<int>(summary.iterations.size());
  fit.passes = summary.num_residual_evaluations + summary.num_jacobian_evaluations;
  fit.converged = summary.termination_type == ceres::CONVERGENCE;
  fit.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  return fit;
}

}  // namespace lobefit
