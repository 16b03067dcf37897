#include "closures/fit_closures.h"

#include <algorithm>
#include <cmath>

#include "closures/closure_problem.h"
#include "measurement/parallel.h"

namespace lobefit {
namespace {

using enum ClosureLayout::ShapeCurve;
using Distributions = std::vector<Distribution>;
constexpr int n = ViewSplines::count;

struct Candidate {
  ClosureProblem problem;
  Eigen::VectorXd x;
  double error;
};

Eigen::VectorXd start_at(const ClosureLayout& layout, const std::vector<double>& alphas,
                         const std::vector<double>& bends) {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(layout.unknowns());
  for (int k = 0; k < layout.specular; ++k) {
    x.segment(layout.shape(k, mean) * n, n)
        .setConstant(std::log(alphas[static_cast<std::size_t>(k)]));
    x.segment(layout.shape(k, bend) * n, n).setConstant(bends[static_cast<std::size_t>(k)]);
  }
  x.tail(layout.closures() * 3 * n).setConstant(0.1);
  return x;
}

constexpr std::array<double, 6> start_alphas = {0.008, 0.025, 0.07, 0.17, 0.4, 0.9};

std::vector<Candidate> starts(const Target& target, int specular) {
  constexpr auto& alphas = start_alphas;
  std::vector<Candidate> all;
  const auto add = [&](const std::vector<double>& chosen, const Distributions& distributions,
                       std::vector<double> bends = {}) {
    const ClosureLayout layout{specular};
    bends.resize(chosen.size(), 0);
    all.push_back({{&target, layout, distributions}, start_at(layout, chosen, bends), 0});
  };
  using enum Distribution;
  const auto count = alphas.size();
  if (specular == 0) add({}, {});
  for (std::size_t i = 0; specular == 1 && i < count; ++i) {
    for (const auto a : {ggx, beckmann}) add({alphas[i]}, {a});
  }
  for (std::size_t i = 0; specular >= 2 && i < count; ++i) {
    for (std::size_t j = i + 1; j < count; ++j) {
      if (specular == 2) {
        add({alphas[i], alphas[j]}, {ggx, ggx});
        add({alphas[i], alphas[j]}, {beckmann, ggx});
        add({alphas[i], alphas[j]}, {beckmann, beckmann});
        // The best two for a lobe that is nearly diffuse are bent apart.
        for (const double bent : {0.3, 0.8}) {
          if (alphas[i] < 0.1) continue;
          add({alphas[i], alphas[j]}, {beckmann, beckmann}, {bent, 0});
          add({alphas[i], alphas[j]}, {beckmann, beckmann}, {0, bent});
        }
      }
      for (std::size_t k = j + 1; specular == 3 && k < count; ++k) {
        add({alphas[i], alphas[j], alphas[k]}, {ggx, ggx, ggx});
      }
    }
  }
  return all;
}

// A candidate with one closure more, of any width and all but black: so it can only become better.
std::vector<Candidate> extended(const Candidate& candidate) {
  const ClosureLayout& from = candidate.problem.layout;
  const ClosureLayout to{from.specular + 1};
  std::vector<Candidate> all;
  for (const double alpha : start_alphas) {
    for (const auto distribution : {Distribution::ggx, Distribution::beckmann}) {
      Candidate more{{candidate.problem.target, to, candidate.problem.distributions},
                     Eigen::VectorXd::Zero(to.unknowns()),
                     0};
      more.problem.distributions.push_back(distribution);
      const auto copy = [&](int to_curve, int from_curve, int curves) {
        more.x.segment(to_curve * n, curves * n) = candidate.x.segment(from_curve * n, curves * n);
      };
      copy(0, 0, from.specular * shape_curves);
      more.x.segment(to.shape(from.specular, mean) * n, n).setConstant(std::log(alpha));
      for (int k = 0; k < from.specular; ++k) copy(to.weight(k, 0), from.weight(k, 0), 3);
      more.x.segment(to.weight(from.specular, 0) * n, 3 * n).setConstant(1e-3);
      copy(to.weight(to.specular, 0), from.weight(from.specular, 0), 3);
      all.push_back(std::move(more));
    }
  }
  return all;
}

// The best closures, their curves still splines; progress runs between two numbers.
Candidate search(const Target& target, int specular, int threads, Monitor& monitor,
                 double progress_from, double progress_to) {
  std::vector<Candidate> found = starts(target, specular);
  if (specular == most_specular_closures) {
    const double middle = (progress_from + progress_to) / 2;
    const auto warm =
        extended(search(target, specular - 1, threads, monitor, progress_from, middle));
    found.insert(found.end(), warm.begin(), warm.end());
    progress_from = middle;
  }
  const auto report = [&](const char* stage, double share) {
    monitor.report(stage, progress_from + share * (progress_to - progress_from));
  };
  const auto follow = [&](double smoothing, int iterations, int stride) {
    parallel_for(static_cast<int>(found.size()), threads, [&](int i) {
      Candidate& candidate = found[static_cast<std::size_t>(i)];
      candidate.x = descend(candidate.problem, stride, candidate.x, smoothing, iterations, monitor);
      candidate.error = smooth_error(candidate.problem, stride, candidate.x, 1e-3);
    });
    std::stable_sort(found.begin(), found.end(),
                     [](const Candidate& a, const Candidate& b) { return a.error < b.error; });
  };
  const auto keep = [&](std::size_t most) {
    found.resize(std::min(found.size(), most), found.front());
  };
  report("Trying closures", 0);
  follow(0.3, 5, 3);
  keep(12);
  report("Trying closures", 0.2);
  follow(0.1, 10, 2);
  keep(5);
  report("Fitting closures", 0.4);
  follow(0.03, 20, 1);
  keep(2);
  report("Fitting closures", 0.7);
  for (const double smoothing : {0.01, 0.002}) follow(smoothing, 30, 1);
  return found.front();
}

// How far curve nodes may be off the curves that were fitted, as a part of what they stand for: so
// little that the error does not show it.
double curve_tolerance(double error) { return std::clamp(0.04 * error, 1e-4, 2e-3); }

double least_over_view(const std::function<double(double)>& of_cosine) {
  double least = of_cosine(1);
  for (int i = 0; i < 32; ++i) least = std::min(least, of_cosine(i / 32.0));
  return least;
}

// By how much the weights of a channel are lowered at each view angle of the target.
struct WeightFactors {
  std::array<ViewCurve, 3> by_channel = {ViewCurve(1), ViewCurve(1), ViewCurve(1)};
};

ClosureSet to_closures(const ClosureProblem& problem, const Eigen::VectorXd& x, double tolerance,
                       const WeightFactors& factors) {
  const ClosureLayout& layout = problem.layout;
  const auto weight_of = [&](int closure, int channel) {
    const int curve = layout.weight(closure, channel);
    const double size = x.segment(curve * n, n).maxCoeff();
    const ViewCurve& factor = factors.by_channel[static_cast<std::size_t>(channel)];
    return ViewCurve::following(
        [&](double cosine) {
          return factor(cosine) * ViewSplines::evaluate(x.data() + curve * n, cosine);
        },
        tolerance * size);
  };
  ClosureSet result;
  for (int c = 0; c < 3; ++c) {
    result.diffuse[static_cast<std::size_t>(c)] = weight_of(layout.specular, c);
  }
  for (int k = 0; k < layout.specular; ++k) {
    const auto sockets = [&](double ClosureSockets::*socket) {
      return [&, k, socket](double cosine) {
        const double inside = std::clamp(cosine, 1e-3, 1 - 1e-6);
        const Vector3 wo(std::sqrt(1 - square(inside)), 0, inside);
        return to_sockets(shape_at(layout, x, k, inside), wo).*socket;
      };
    };
    SpecularClosure closure;
    closure.distribution = problem.distributions[static_cast<std::size_t>(k)];
    // A highlight moved by a part of its width changes as much as one that is wider by that part.
    const double least_roughness = least_over_view(sockets(&ClosureSockets::roughness));
    closure.roughness =
        ViewCurve::following(sockets(&ClosureSockets::roughness), tolerance * least_roughness);
    closure.anisotropy = ViewCurve::following(sockets(&ClosureSockets::anisotropy), 4 * tolerance);
    closure.bend = ViewCurve::following(sockets(&ClosureSockets::bend),
                                        4 * tolerance * square(least_roughness));
    for (int c = 0; c < 3; ++c) closure.weight[static_cast<std::size_t>(c)] = weight_of(k, c);
    result.specular.push_back(std::move(closure));
  }
  return result;
}

std::vector<SeenAtAngle> look_at(const Target& target, const ClosureSet& closures) {
  std::vector<SeenAtAngle> seen;
  for (const TargetView& view : target) {
    SeenAtAngle at{view.wo.z(), Rgb::Zero(), Rgb::Zero(), 0};
    const ClosuresAtView seen_closures(closures, view.wo);
    double error = 0, light = 0;
    for (const TargetLight& to : view.lights) {
      const Rgb reflected = seen_closures.evaluate(to.wi, to.half);
      at.target_albedo += to.solid_angle * to.reflected;
      at.closures_albedo += to.solid_angle * reflected;
      error += to.weight * (reflected - to.reflected).abs().sum();
      light += to.weight * to.reflected.sum();
    }
    at.relative_error = light > 0 ? error / light : 0;
    seen.push_back(at);
  }
  return seen;
}

// Where closures reflect more than they may, the factors that mend it.
WeightFactors energy_factors(const std::vector<SeenAtAngle>& seen, bool cap_albedo) {
  constexpr double allowed = 1.01;
  WeightFactors factors;
  for (std::size_t c = 0; c < 3; ++c) {
    const auto channel = static_cast<Eigen::Index>(c);
    std::vector<ViewCurve::Point> points;
    for (const SeenAtAngle& at : seen) {
      double most = allowed * at.target_albedo[channel];
      if (cap_albedo) most = std::min(most, 1.0);
      const double now = at.closures_albedo[channel];
      points.push_back({at.cosine, now > most ? most / now : 1});
    }
    factors.by_channel[c] = ViewCurve(std::move(points));
  }
  return factors;
}

double error_of_closures(const Target& target, const ClosureSet& closures) {
  double error = 0;
  for (const TargetView& view : target) {
    const ClosuresAtView at(closures, view.wo);
    for (const TargetLight& light : view.lights) {
      error += light.weight * (at.evaluate(light.wi, light.half) - light.reflected).abs().sum();
    }
  }
  return error;
}

// Leaves out what the error does not miss: each closure in turn, and the colour of a weight that is
// all but grey.
void leave_out(const Target& target, FittedClosures& fitted) {
  const double missed = 0.005 * fitted.error;
  const auto adopt = [&](const ClosureSet& tried) {
    const double error = error_of_closures(target, tried);
    if (!(error < fitted.error + missed)) return false;
    fitted.closures = tried;
    fitted.error = error;
    return true;
  };
  ClosureSet without_diffuse = fitted.closures;
  without_diffuse.diffuse = {};
  adopt(without_diffuse);
  for (std::size_t k = 0; k < fitted.closures.specular.size();) {
    ClosureSet without = fitted.closures;
    without.specular.erase(without.specular.begin() + static_cast<std::ptrdiff_t>(k));
    if (!adopt(without)) ++k;
  }
  const auto try_grey = [&](auto&& weight_in) {
    ClosureSet grey = fitted.closures;
    RgbCurve& weight = weight_in(grey);
    weight[0] = weight[2] = weight[1];
    adopt(grey);
  };
  try_grey([](ClosureSet& set) -> RgbCurve& { return set.diffuse; });
  for (std::size_t k = 0; k < fitted.closures.specular.size(); ++k) {
    try_grey([k](ClosureSet& set) -> RgbCurve& { return set.specular[k].weight; });
  }
}

}  // namespace

FittedClosures fit_closures(const Target& target, const ClosureFitOptions& options,
                            Monitor& monitor) {
  if (target.empty()) return {};
  const Candidate best =
      search(target, options.specular, thread_count(options.threads), monitor, 0, 1);
  const double tolerance = curve_tolerance(best.error);
  WeightFactors factors;
  FittedClosures result{to_closures(best.problem, best.x, tolerance, factors), 0, {}};
  factors = energy_factors(look_at(target, result.closures), options.cap_albedo);
  result.closures = to_closures(best.problem, best.x, tolerance, factors);
  result.error = error_of_closures(target, result.closures);
  leave_out(target, result);
  result.by_view = look_at(target, result.closures);
  // Of a target that is all but black, Cycles drops closures that the fit relies on: fewer of more
  // weight may then be nearer.
  if (options.specular > 0 && result.error > 1.5 * best.error) {
    ClosureFitOptions fewer = options;
    --fewer.specular;
    FittedClosures other = fit_closures(target, fewer, monitor);
    if (other.error < result.error) return other;
  }
  return result;
}

FittedClosures fit_closures_within(const Target& target, double tolerance,
                                   ClosureFitOptions options, Monitor& monitor) {
  FittedClosures best;
  for (options.specular = 0; options.specular <= most_specular_closures; ++options.specular) {
    FittedClosures fitted = fit_closures(target, options, monitor);
    if (options.specular == 0 || fitted.error < best.error) best = std::move(fitted);
    if (best.error <= tolerance) break;
  }
  return best;
}

}  // namespace lobefit
