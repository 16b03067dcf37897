#include "fitting/fit.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>
#include <sstream>
#include <utility>

#include "fitting/minimise.h"
#include "fitting/objective.h"
#include "fitting/samples.h"
#include "fitting/scan.h"
#include "fitting/variables.h"
#include "measurement/input_error.h"
#include "measurement/parallel.h"

namespace lobefit {
namespace {

using Eigen::VectorXd;

// Samples that the best starts are polished on, one in how many of these that all starts are tried
// on, and one in how many of the latter that are scanned for starts.
constexpr std::size_t finalist_samples = 16000, finalists_to_candidates = 8, candidates_to_scan = 4;
constexpr std::size_t max_candidates = 8, max_finalists = 3;
// Starts that end this close to the best one, relatively, have found the same optimum.
constexpr double agreement = 0.005;
constexpr const char* scan_stage = "Looking for starts";

// Whether the interpolated lobe is Phong's or Blinn-Phong's.
bool is_pure(double interpolation) { return interpolation == 0 || interpolation == 1; }

class Stopwatch {
 public:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

class Fitter {
 public:
  Fitter(const Measurement& measurement, const FitOptions& options, Monitor& monitor)
      : measurement_(measurement),
        options_(options),
        monitor_(monitor),
        threads_(thread_count(options.threads)),
        variables_(options.kind, options.fresnel, options.separate_channels,
                   options.schedule == Schedule::stages ? Specular::coefficient : Specular::peak),
        all_(all_samples(measurement, options)),
        some_(subsample(all_, finalist_samples, threads_)),
        few_(every_nth(some_, finalists_to_candidates)) {
    if (valid_samples() == 0) {
      std::ostringstream message;
      message << "expected reflectances within " << options.max_angle_degrees
              << " degrees of the normal, found no valid bin.";
      throw InputError(message.str());
    }
  }

  Fit run() {
    const Stopwatch start_watch;
    monitor_.report(scan_stage, 0.1);
    const std::vector<Candidate> starts = find_starts();
    fit_.start_seconds = start_watch.seconds();
    const Stopwatch fit_watch;
    const VectorXd x = without_dust(run_schedule(starts));
    fit_.fit_seconds = fit_watch.seconds();
    fit_.parameters = variables_.to_parameters(x, all_.unit);
    if (options_.uncertainty) {
      monitor_.report("Fitting without each part of the data", 0.85);
      fit_.uncertainty = jackknife(some_, variables_, options_.norm, x, threads_, monitor_);
    }
    monitor_.report("Measuring the error", 0.95);
    fit_.errors = error_figures(measurement_, fit_.parameters, threads_);
    name_degenerate(x);
    return std::move(fit_);
  }

  Parameters best_start() const {
    return variables_.to_parameters(find_starts().front().x, all_.unit);
  }

 private:
  std::vector<Candidate> find_starts() const {
    return scan_shapes(every_nth(few_, candidates_to_scan), variables_, options_.norm,
                       max_candidates, threads_, monitor_);
  }

  VectorXd run_schedule(const std::vector<Candidate>& starts) {
    switch (options_.schedule) {
      case Schedule::stages:
        return run_stages(starts.front().x);
      case Schedule::joint:
        monitor_.report("Fitting on all bins", 0.3);
        return run_stage("all parameters on all bins", variables_.all(), starts.front().x,
                         fine_precision())
            .x;
      case Schedule::subsample:
        return run_subsample(starts);
      case Schedule::polish:
        break;
    }
    return run_polish(starts);
  }

  // x without a specular part that is too dark to change a stored value: what rounding left of
  // none.
  VectorXd without_dust(VectorXd x) const {
    constexpr double dust = 1e-9;
    const Parameters lobe = as_interpolated(variables_.to_parameters(x, 1));
    if (lobe.specular.maxCoeff() < dust) x.segment<3>(Variables::specular).setZero();
    return x;
  }

  VectorXd run_stages(VectorXd x) {
    const std::pair<const char*, std::vector<int>> stages[] = {
        {"(i) rho_d, k_s", variables_.reflectances()},
        {"(ii) s, alpha, eta", variables_.shape()},
        {"(iii) s, alpha, k_s, eta", variables_.shape_and_specular()}};
    double progress = 0.2;
    for (const auto& [name, free] : stages) {
      monitor_.report("Fitting by the paper's stages", progress);
      x = run_stage(name, free, x, fine_precision()).x;
      progress += 0.25;
    }
    return x;
  }

  // Polish from the starts on a subsample, and of the best of these on a larger one; the error that
  // it leaves over all bins is not known then.
  Minimum run_on_subsample(const std::vector<Candidate>& candidates) {
    const Stopwatch watch;
    Stage stage{"polish of " + std::to_string(candidates.size()) +
                    " starts on a subsample, then of the best on a larger one",
                0,
                0,
                0,
                some_.size(),
                0};
    monitor_.report("Trying the starts", 0.3);
    std::vector<Minimum> minima = polish(few_, starts_of(candidates), coarse_precision(), stage);
    judge_certainty(minima);
    monitor_.report("Trying the best of them", 0.5);
    Minimum best = best_finalist(best_of_each_shape(minima), stage);
    fit_.converged = best.converged;
    stage.seconds = watch.seconds();
    fit_.stages.push_back(stage);
    return best;
  }

  // The best minimum on the larger subsample. Where starts disagree there are several basins, and
  // for a lobe narrower than a bin a row of them along alpha: those next to the best are then tried
  // too.
  Minimum best_finalist(const std::vector<Minimum>& starts, Stage& stage) const {
    Minimum best = polish(some_, starts_of(starts), finishing_precision(), stage).front();
    if (fit_.certainty.agree == fit_.certainty.starts) return best;
    const std::vector<VectorXd> beside = beside_in_alpha(best.x);
    if (beside.empty()) return best;
    const Minimum next = polish(some_, beside, finishing_precision(), stage).front();
    return next.true_value < best.true_value ? next : best;
  }

  // Starts whose odds of alpha to 1 - alpha are half and twice those of x; none of a pure lobe.
  std::vector<VectorXd> beside_in_alpha(const VectorXd& x) const {
    const int alpha = variables_.interpolation();
    if (alpha < 0 || is_pure(x[alpha])) return {};
    std::vector<VectorXd> beside;
    for (const double factor : {0.5, 2.0}) {
      const double odds = factor * x[alpha] / (1 - x[alpha]);
      beside.push_back(x);
      beside.back()[alpha] = odds / (1 + odds);
    }
    return beside;
  }

  // Of sorted minima the best ones; where several have one shape, it is polished once. One that is
  // so far off on a subsample is not the best on a larger one.
  std::vector<Minimum> best_of_each_shape(const std::vector<Minimum>& sorted) const {
    constexpr double hopeless = 0.1;
    std::vector<Minimum> result;
    const auto same_shape = [&](const Minimum& one, const Minimum& other) {
      constexpr double near = 0.05;  // of log s and of alpha
      const int first = Variables::log_exponent, alpha = variables_.interpolation();
      const int count = variables_.exponents() + (alpha >= 0 ? 1 : 0);
      return (one.x.segment(first, count) - other.x.segment(first, count)).cwiseAbs().maxCoeff() <
             near;
    };
    for (const Minimum& minimum : sorted) {
      if (result.size() == max_finalists) break;
      if (minimum.true_value > (1 + hopeless) * sorted.front().true_value) break;
      const bool seen = std::any_of(result.begin(), result.end(), [&](const Minimum& better) {
        return same_shape(minimum, better);
      });
      if (!seen) result.push_back(minimum);
    }
    return result;
  }

  VectorXd run_subsample(const std::vector<Candidate>& candidates) {
    VectorXd x = run_on_subsample(candidates).x;
    constexpr double smoothing = 1;  // which the true value does not have
    const Objective all(all_, variables_, options_.norm, smoothing, threads_);
    fit_.stages.front().error = mean_error(all.evaluate(x).true_value);
    return x;
  }

  VectorXd run_polish(const std::vector<Candidate>& candidates) {
    const Minimum first = run_on_subsample(candidates);
    monitor_.report("Polishing on all bins", 0.6);
    const Minimum last =
        run_stage("polish on all bins", variables_.all(), first.x, last_precision(), first.pause);
    // What the starts came to over all bins is where the last polish began.
    fit_.stages.front().error = mean_error(last.start_value);
    return last.x;
  }

  template <typename Start>
  static std::vector<VectorXd> starts_of(const std::vector<Start>& starts) {
    std::vector<VectorXd> points;
    points.reserve(starts.size());
    for (const Start& start : starts) points.push_back(start.x);
    return points;
  }

  // All variables, but for a start whose alpha is 0 or 1: it stays there until the polish on all
  // bins, so that the result is no worse than the pure Phong or Blinn-Phong lobe. For s near 0 the
  // objective jumps where bins leave the lobe, and a subsample sees too few of those.
  std::vector<int> movable(const VectorXd& start) const {
    std::vector<int> free = variables_.all();
    const int alpha = variables_.interpolation();
    if (alpha >= 0 && is_pure(start[alpha])) std::erase(free, alpha);
    return free;
  }

  // The minima on a subsample from all starts, best first; what they took is added to the stage.
  std::vector<Minimum> polish(const Samples& samples, const std::vector<VectorXd>& starts,
                              const Precision& precision, Stage& stage) const {
    std::vector<Minimum> minima(starts.size());
    parallel_for(static_cast<int>(starts.size()), threads_, [&](int i) {
      const auto at = static_cast<std::size_t>(i);
      minima[at] = minimise(samples, variables_, options_.norm, movable(starts[at]), starts[at],
                            precision, 1, monitor_);
    });
    for (const Minimum& minimum : minima) {
      stage.iterations += minimum.iterations;
      stage.touched += minimum.passes * static_cast<double>(samples.size());
    }
    std::stable_sort(minima.begin(), minima.end(), [](const Minimum& left, const Minimum& right) {
      return left.true_value < right.true_value;
    });
    return minima;
  }

  Minimum run_stage(const std::string& name, const std::vector<int>& free, const VectorXd& x,
                    const Precision& precision, NewtonPause pause = {}) {
    const Stopwatch watch;
    Minimum minimum =
        minimise(all_, variables_, options_.norm, free, x, precision, threads_, monitor_, pause);
    fit_.converged = minimum.converged;
    fit_.stages.push_back({name, mean_error(minimum.true_value), watch.seconds(),
                           minimum.iterations, all_.size(),
                           minimum.passes * static_cast<double>(all_.size())});
    return minimum;
  }

  bool is_linear() const { return options_.norm == Norm::l1 || options_.norm == Norm::cosine_l1; }

  // The mean over all bins that a true value stands for.
  double mean_error(double true_value) const {
    const double weight = std::accumulate(all_.weight.begin(), all_.weight.end(), 0.0);
    constexpr double values_of_a_sample = 6;  // three channels, two halves
    const double unit = is_linear()                 ? all_.unit
                        : options_.norm == Norm::l2 ? all_.unit * all_.unit
                                                    : 1;
    return true_value * unit / (values_of_a_sample * weight);
  }

  // What a fit leaves over on a subsample is not judged below this: the rounding of stored values.
  double rounding_of(const Samples& samples) const {
    constexpr double smoothing = 1;  // which the true value does not have
    const double single = std::numeric_limits<float>::epsilon();
    const Objective objective(samples, variables_, options_.norm, smoothing, 1);
    const double black = objective.evaluate(VectorXd::Zero(variables_.count())).true_value;
    return black * (is_linear() ? single : single * single);
  }

  // A start that held alpha cannot agree unless the optimum is a pure lobe; it counts only then.
  void judge_certainty(const std::vector<Minimum>& sorted) {
    const double best = std::max(sorted.front().true_value, rounding_of(few_));
    const int alpha = variables_.interpolation();
    double worst = best;
    for (const Minimum& m : sorted) {
      const bool agrees = m.true_value <= (1 + agreement) * best;
      if (!agrees && alpha >= 0 && is_pure(m.x[alpha])) continue;
      ++fit_.certainty.starts;
      if (agrees) ++fit_.certainty.agree;
      worst = std::max(worst, m.true_value);
    }
    fit_.certainty.spread = best > 0 ? (worst - best) / best : 0;
  }

  std::ptrdiff_t valid_samples() const {
    return std::count_if(all_.weight.begin(), all_.weight.end(), [](float w) { return w > 0; });
  }

  void name_degenerate(const VectorXd& x) {
    const auto warn = [&](const char* sentence) { fit_.warnings.emplace_back(sentence); };
    if (valid_samples() < variables_.count()) {
      warn("The measurement has fewer valid bins than the model has parameters.");
    }
    constexpr double black = 0.999;  // black itself has the relative error 1
    if (std::min(fit_.errors.relative_l1.pooled, fit_.errors.relative_l1_cosine.pooled) > black) {
      warn("The fit is no closer to the measurement than black is.");
    }
    const bool no_specular = !(x.segment<3>(Variables::specular).maxCoeff() > 0);
    if (no_specular) {
      warn(
          "The fit has no specular part; exponent, interpolation and index of refraction mean "
          "nothing.");
    }
    if (!(x.segment<3>(Variables::diffuse).maxCoeff() > 0)) warn("The fit has no diffuse part.");
    if (no_specular) return;
    const auto at_bound = [&](int i) {
      return i >= 0 && (x[i] <= variables_.lower()[i] || x[i] >= variables_.upper()[i]);
    };
    for (int i = 0; i < variables_.exponents(); ++i) {
      if (at_bound(Variables::log_exponent + i)) {
        warn("The exponent stands at the end of its range; the data do not determine it.");
      } else if (x[Variables::log_exponent + i] < std::log(0.5)) {
        warn("The exponent is below 0.5; the lobe is as wide as a diffuse part.");
      }
    }
    // Beyond the first theta_h such a lobe has not a thousandth of its light.
    const double beside = 1 - std::pow(bin_centres().cos_h[1], 4);
    if (as_interpolated(fit_.parameters).exponent.maxCoeff() * beside > std::log(1000)) {
      warn("The lobe is narrower than the bins; the data only tell that it is.");
    }
    const int ior = variables_.log_excess_ior();
    if (at_bound(ior) || (ior >= 0 && x[ior] < std::log(0.01))) {
      warn(
          "The index of refraction is at the edge of what the data determine; with the specular "
          "coefficient it makes one number.");
    }
  }

  const Measurement& measurement_;
  const FitOptions options_;
  Monitor& monitor_;
  const int threads_;
  const Variables variables_;
  const Samples all_, some_, few_;
  Fit fit_;
};

}  // namespace

Fit fit_model(const Measurement& measurement, const FitOptions& options, Monitor& monitor) {
  return Fitter(measurement, options, monitor).run();
}

Parameters best_start(const Measurement& measurement, const FitOptions& options, Monitor& monitor) {
  return Fitter(measurement, options, monitor).best_start();
}

}  // namespace lobefit
