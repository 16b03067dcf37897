#include "fitting/objective.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "fitting/kernel.h"
#include "measurement/parallel.h"
#include "reflectance/fresnel.h"

namespace lobefit {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

KernelNorm kernel_norm(Norm norm) {
  switch (norm) {
    case Norm::l2:
      return KernelNorm::l2;
    case Norm::log_l2:
      return KernelNorm::log_l2;
    case Norm::l1:
    case Norm::cosine_l1:
      break;
  }
  return KernelNorm::smoothed_l1;
}

// The variables of the lobe k_s R_F base^s that every model is (as_interpolated): rho_d/pi of
// three channels, k_s of three, log s of each group of channels with one exponent, alpha,
// log(eta - 1). The kernel knows these alone.
struct LobeVariables {
  explicit LobeVariables(int groups) : alpha(6 + groups), third(7 + groups), count(8 + groups) {}
  int alpha, third, count;
};

class Assembly {
 public:
  Assembly(const Variables& variables, const VectorXd& x)
      : variables_(variables),
        x_(x),
        parameters_(as_interpolated(variables.to_parameters(x, 1))),
        lobe_(variables.exponents()) {}

  int groups() const { return variables_.exponents(); }

  KernelInput input(const Samples& samples, const Samples::Run& run, int group, double smoothing,
                    Curvature curvature) const {
    const int first = groups() == 1 ? 0 : group, channels = groups() == 1 ? 3 : 1;
    KernelInput in{};
    in.count = run.end - run.begin;
    in.u_phong = samples.u_phong.data() + run.begin;
    in.u_blinn = samples.u_blinn.data() + run.begin;
    in.weight = samples.weight.data() + run.begin;
    in.channels = channels;
    for (int c = 0; c < channels; ++c) {
      in.diffuse[c] = parameters_.diffuse[first + c] / pi;
      in.specular[c] = parameters_.specular[first + c];
      for (int half = 0; half < 2; ++half) {
        in.measured[c][half] = samples.measured[first + c][half].data() + run.begin;
      }
    }
    in.exponent = parameters_.exponent[first];
    in.interpolation = parameters_.interpolation;
    in.fresnel = 1;
    if (parameters_.ior) {
      const FresnelReflectance fresnel = fresnel_reflectance(run.cos_theta_d, *parameters_.ior);
      in.fresnel = fresnel.value;
      // The variable is log(eta - 1).
      const double excess = *parameters_.ior - 1;
      in.fresnel_slope = fresnel.derivative * excess;
      in.fresnel_curvature = fresnel.second_derivative * excess * excess + in.fresnel_slope;
    }
    in.smoothing = smoothing;
    in.newton = curvature == Curvature::newton;
    return in;
  }

  // Gradient and matrix by the lobe's variables, from the sums of one group over all runs; `curved`
  // adds what the curvature of the model does to the matrix.
  void add(const KernelSums& sums, int group, bool curved, VectorXd& gradient,
           MatrixXd& hessian) const {
    const int first = groups() == 1 ? 0 : group, channels = groups() == 1 ? 3 : 1;
    const int shape[3] = {6 + group, lobe_.alpha, lobe_.third};
    for (int c = 0; c < channels; ++c) {
      const int d = first + c, k = 3 + first + c;
      const double specular = parameters_.specular[first + c];
      gradient[d] += sums.r[c];
      gradient[k] += sums.rg[c];
      hessian(d, d) += sums.w[c];
      hessian(k, d) += sums.wg[c];
      hessian(k, k) += sums.wgg[c];
      for (int x = 0; x < 3; ++x) {
        hessian(shape[x], d) += specular * sums.wx[c][x];
        hessian(shape[x], k) += specular * sums.wgx[c][x] + (curved ? sums.rx[c][x] : 0);
        gradient[shape[x]] += specular * sums.rx[c][x];
      }
    }
    int pair = 0;
    for (int x = 0; x < 3; ++x) {
      for (int y = x; y < 3; ++y, ++pair) {
        hessian(shape[y], shape[x]) += sums.wxx[pair] + (curved ? sums.rxx[pair] : 0);
      }
    }
  }

  // d(lobe's variables) / d(fit's variables).
  MatrixXd chain() const {
    MatrixXd chain = MatrixXd::Zero(lobe_.count, variables_.count());
    chain.block<3, 3>(0, Variables::diffuse).setIdentity();
    for (int c = 0; c < 3; ++c) {
      const SpecularScale scale = variables_.specular_scale(x_, c);
      chain(3 + c, Variables::specular + c) = scale.factor;
      if (scale.by >= 0) chain(3 + c, scale.by) = parameters_.specular[c] * scale.log_slope;
    }
    chain.block(6, Variables::log_exponent, groups(), groups()).setIdentity();
    if (variables_.interpolation() >= 0) chain(lobe_.alpha, variables_.interpolation()) = 1;
    if (variables_.log_excess_ior() >= 0) chain(lobe_.third, variables_.log_excess_ior()) = 1;
    return chain;
  }

  // What the curvature of k_s as a function of the specular variable and of another adds to the
  // matrix of the fit's variables, given the gradient by the lobe's.
  void add_scale_curvature(const VectorXd& gradient, MatrixXd& hessian) const {
    for (int c = 0; c < 3; ++c) {
      const int specular = Variables::specular + c;
      const SpecularScale scale = variables_.specular_scale(x_, c);
      if (scale.by < 0) continue;
      const double both = gradient[3 + c] * scale.factor * scale.log_slope;
      hessian(specular, scale.by) += both;
      hessian(scale.by, specular) += both;
      hessian(scale.by, scale.by) += gradient[3 + c] * parameters_.specular[c] *
                                     (scale.log_slope * scale.log_slope + scale.log_curvature);
    }
  }

  int lobe_count() const { return lobe_.count; }

 private:
  const Variables& variables_;
  const VectorXd& x_;
  Parameters parameters_;
  LobeVariables lobe_;
};

void add(KernelSums& total, const KernelSums& part) {
  // KernelSums is doubles throughout, summed one by one.
  static_assert(sizeof(KernelSums) % sizeof(double) == 0);
  auto* to = reinterpret_cast<double*>(&total);
  const auto* from = reinterpret_cast<const double*>(&part);
  for (std::size_t i = 0; i < sizeof(KernelSums) / sizeof(double); ++i) to[i] += from[i];
}

}  // namespace

const Evaluation& Objective::evaluate(const VectorXd& x, Curvature curvature) const {
  auto known = std::find_if(answers_.begin(), answers_.end(), [&](const Answer& answer) {
    return answer.curvature == curvature && answer.is_at(x);
  });
  if (known == answers_.end()) *--known = {x, curvature, pass(x, curvature)};
  std::rotate(answers_.begin(), known, known + 1);
  return answers_.front().evaluation;
}

const Evaluation& Objective::evaluate_slope(const VectorXd& x, Curvature wanted) const {
  const auto known = std::find_if(answers_.begin(), answers_.end(),
                                  [&](const Answer& answer) { return answer.is_at(x); });
  return evaluate(x, known == answers_.end() ? wanted : known->curvature);
}

Evaluation Objective::pass(const VectorXd& x, Curvature curvature) const {
  ++passes_;
  const Assembly assembly(variables_, x);
  const int groups = assembly.groups(), runs = static_cast<int>(samples_.runs.size());
  const auto place = [groups](std::ptrdiff_t run, int group) {
    return static_cast<std::size_t>(run * groups + group);
  };
  std::vector<KernelSums> sums(place(runs, 0));
  parallel_for(runs, threads_, [&](int r) {
    for (int group = 0; group < groups; ++group) {
      sums[place(r, group)] =
          run_kernel(assembly.input(samples_, samples_.runs[static_cast<std::size_t>(r)], group,
                                    smoothing_, curvature),
                     kernel_norm(norm_));
    }
  });
  VectorXd gradient = VectorXd::Zero(assembly.lobe_count());
  MatrixXd hessian = MatrixXd::Zero(assembly.lobe_count(), assembly.lobe_count());
  // The misfit of logarithms curves in another way.
  const bool curved = curvature == Curvature::newton && norm_ != Norm::log_l2;
  Evaluation result;
  for (int group = 0; group < groups; ++group) {
    KernelSums total{};
    for (int r = 0; r < runs; ++r) add(total, sums[place(r, group)]);
    result.value += total.value;
    result.true_value += total.true_value;
    assembly.add(total, group, curved, gradient, hessian);
  }
  const MatrixXd full = hessian.selfadjointView<Eigen::Lower>();
  const MatrixXd chain = assembly.chain();
  result.gradient = chain.transpose() * gradient;
  result.hessian = chain.transpose() * full * chain;
  if (curved) assembly.add_scale_curvature(gradient, result.hessian);
  return result;
}

}  // namespace lobefit
