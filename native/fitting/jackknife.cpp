#include "fitting/jackknife.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "fitting/minimise.h"
#include "fitting/objective.h"
#include "measurement/parallel.h"

namespace lobefit {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double student_t = 2.064;

// A single level of smoothing, since every fit starts close by: a finer one changes the intervals
// by a twentieth, and a coarser tolerance leaves metals half way.
Precision precision() { return {0, 0.03, 1e-6, 100}; }

// Which variables to move together, one after the other. For s < 1 the slope by alpha has no bound
// at the edge of the lobe, where it holds Newton's steps up: the others then move first. Nor does a
// step lead away from its bounds there, so that it starts beside them (`inside`).
std::vector<std::vector<int>> stages(const Variables& variables, const VectorXd& x) {
  std::vector<std::vector<int>> result = {variables.all()};
  const auto exponents = x.segment(Variables::log_exponent, variables.exponents());
  if (variables.interpolation() >= 0 && exponents.minCoeff() < 0) {
    std::vector<int> without = variables.all();
    std::erase(without, variables.interpolation());
    result.insert(result.begin(), without);
  }
  return result;
}

VectorXd inside(const Variables& variables, VectorXd x) {
  constexpr double beside = 0.05;
  if (stages(variables, x).size() == 1) return x;
  double& alpha = x[variables.interpolation()];
  alpha = std::clamp(alpha, beside, 1 - beside);
  return x;
}

// Splits the samples of a strip into patches of theta_h: u_blinn = 1 - cos^4 theta_h rises with it.
// Samples of one theta_h stay together.
void split_strip(const Samples& samples, const std::vector<std::size_t>& strip, int first_block,
                 std::vector<int>& block) {
  std::vector<double> sorted;
  sorted.reserve(strip.size());
  for (const std::size_t i : strip) sorted.push_back(samples.u_blinn[i]);
  std::sort(sorted.begin(), sorted.end());
  for (const std::size_t i : strip) {
    const auto before = std::lower_bound(sorted.begin(), sorted.end(), samples.u_blinn[i]);
    const auto rank = static_cast<std::size_t>(before - sorted.begin());
    block[i] = first_block + static_cast<int>(jackknife_strips * rank / strip.size());
  }
}

Samples without_block(const Samples& samples, const std::vector<int>& block, int left_out) {
  Samples rest = samples;
  for (std::size_t i = 0; i < rest.size(); ++i) {
    if (block[i] == left_out) rest.weight[i] = 0;
  }
  return rest;
}

MatrixXd jackknife_covariance(const MatrixXd& results) {
  const auto n = static_cast<double>(results.cols());
  const MatrixXd apart = results.colwise() - results.rowwise().mean();
  return (n - 1) / n * apart * apart.transpose();
}

MatrixXd correlation_of(const MatrixXd& covariance) {
  const VectorXd deviation = covariance.diagonal().cwiseSqrt();
  const VectorXd scale = (deviation.array() > 0).select(deviation.cwiseInverse(), 0);
  MatrixXd correlation = scale.asDiagonal() * covariance * scale.asDiagonal();
  correlation.diagonal().setOnes();
  return correlation;
}

class Judge {
 public:
  Judge(const Variables& variables, const VectorXd& x, const VectorXd& low, const VectorXd& high)
      : variables_(variables), x_(x), low_(low), high_(high) {}

  bool determined(int i) const {
    if (i == variables_.interpolation()) return high_[i] - low_[i] <= 0.5;
    if (i >= Variables::log_exponent) {
      const bool inside = low_[i] > variables_.lower()[i] && high_[i] < variables_.upper()[i];
      return inside && high_[i] - low_[i] <= std::log(2);
    }
    const int first = i < Variables::specular ? Variables::diffuse : Variables::specular;
    const double black = 0.01 * x_.segment<3>(first).maxCoeff();
    return high_[i] <= 2 * std::max(low_[i], black);
  }

 private:
  const Variables& variables_;
  const VectorXd &x_, &low_, &high_;
};

}  // namespace

std::vector<int> jackknife_block_of(const Samples& samples) {
  // The samples of every theta_d that count, in the order of theta_d.
  std::vector<std::vector<std::size_t>> runs;
  std::size_t all = 0, before = 0;
  for (const Samples::Run& run : samples.runs) {
    auto& counted = runs.emplace_back();
    for (std::size_t i = run.begin; i < run.end; ++i) {
      if (samples.weight[i] > 0) counted.push_back(i);
    }
    all += counted.size();
  }
  std::vector<std::vector<std::size_t>> strips(jackknife_strips);
  for (const auto& run : runs) {
    if (run.empty()) continue;
    auto& strip = strips[jackknife_strips * before / all];
    strip.insert(strip.end(), run.begin(), run.end());
    before += run.size();
  }
  std::vector<int> block(samples.size(), 0);
  for (int s = 0; s < jackknife_strips; ++s) {
    split_strip(samples, strips[static_cast<std::size_t>(s)], s * jackknife_strips, block);
  }
  return block;
}

Uncertainty jackknife(const Samples& samples, const Variables& variables, Norm norm,
                      const VectorXd& x, int threads, const Monitor& monitor) {
  const auto start = std::chrono::steady_clock::now();
  const auto fitted = [&](const Samples& to, VectorXd from, int on_threads) {
    for (const std::vector<int>& free : stages(variables, from)) {
      from = minimise(to, variables, norm, free, from, precision(), on_threads, monitor).x;
    }
    return from;
  };
  const std::vector<int> block = jackknife_block_of(samples);
  const VectorXd optimum = fitted(samples, inside(variables, x), threads);
  MatrixXd results(x.size(), jackknife_blocks);
  parallel_for(jackknife_blocks, threads, [&](int b) {
    results.col(b) =
        variables.with_coefficients(fitted(without_block(samples, block, b), optimum, 1));
  });
  const MatrixXd covariance = jackknife_covariance(results);
  const VectorXd reach = student_t * covariance.diagonal().cwiseSqrt();
  const VectorXd middle = variables.with_coefficients(x);
  VectorXd low = variables.clamp(middle - reach), high = variables.clamp(middle + reach);
  const Objective objective(samples, variables, norm, precision().finest, 1);
  const MatrixXd curvature = objective.evaluate(x).hessian;
  for (int i = Variables::log_exponent; i < variables.count(); ++i) {
    if (curvature(i, i) > 0) continue;
    low[i] = variables.lower()[i];
    high[i] = variables.upper()[i];
  }
  Uncertainty found;
  const Variables reported(variables.kind(), variables.log_excess_ior() >= 0,
                           variables.exponents() == 3, Specular::coefficient);
  found.low = reported.to_parameters(low, samples.unit);
  found.high = reported.to_parameters(high, samples.unit);
  found.correlation = correlation_of(covariance);
  found.blocks = jackknife_blocks;
  const Judge judge(variables, middle, low, high);
  const std::vector<std::string> names = variables.names();
  for (int i = 0; i < variables.count(); ++i) {
    if (!judge.determined(i)) found.undetermined.push_back(names[static_cast<std::size_t>(i)]);
  }
  found.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return found;
}

}  // namespace lobefit
