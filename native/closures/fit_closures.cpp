#include "closures/fit_closures.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "fitting/parallel.h"

namespace lobefit {
namespace {

// Cycles 4.2 takes anything with alpha_x alpha_y below 5e-7 for a mirror, and single precision
// loses the peak of a lobe much narrower than this.
const double least_log_alpha = std::log(0.002);

// The unknowns are coefficients of ViewSplines. Each specular closure has three shape curves,
// then every closure, the diffuse one last, has a weight curve for each channel.
//   mean   m, (ln alpha_x + ln alpha_y) / 2
//   spread h, (ln alpha_y - ln alpha_x) / 2 = h sin^2 theta
//   bend   g, tan(tilt) = g sin theta
// so that a closure is isotropic and not bent at normal incidence whatever they are.
enum ShapeCurve { mean, spread, bend, shape_curves };
constexpr int n = ViewSplines::count;

struct Layout {
  int specular;
  int closures() const { return specular + 1; }
  int shape(int closure, int curve) const { return closure * shape_curves + curve; }
  int weight(int closure, int channel) const {
    return specular * shape_curves + closure * 3 + channel;
  }
  int curves() const { return specular * shape_curves + closures() * 3; }
  int unknowns() const { return curves() * n; }
};

using Distributions = std::vector<Distribution>;

struct Problem {
  const Target* target;
  Layout layout;
  Distributions distributions;
};

struct Bounds {
  Eigen::VectorXd least, greatest;
};

Bounds bounds_of(const Layout& layout) {
  Bounds bounds{Eigen::VectorXd::Zero(layout.unknowns()),
                Eigen::VectorXd::Constant(layout.unknowns(), 1e6)};
  for (int k = 0; k < layout.specular; ++k) {
    const auto set = [&](int curve, double least, double greatest) {
      bounds.least.segment(layout.shape(k, curve) * n, n).setConstant(least);
      bounds.greatest.segment(layout.shape(k, curve) * n, n).setConstant(greatest);
    };
    set(mean, least_log_alpha, 0);
    set(spread, -3, 3);
    set(bend, -3, 3);
  }
  return bounds;
}

// The values of all curves at one view angle, and the splines they come from.
struct AtView {
  ViewSplines::Support support;
  Eigen::VectorXd curves;
  double sine;
};

AtView at_view(const Eigen::VectorXd& x, double cosine) {
  AtView at{ViewSplines::at(cosine), Eigen::VectorXd(x.size() / n),
            std::sqrt(std::max(0.0, 1 - cosine * cosine))};
  for (int curve = 0; curve < at.curves.size(); ++curve) {
    double value = 0;
    for (int i = 0; i < 4; ++i) {
      value += at.support.share[static_cast<std::size_t>(i)] * x[curve * n + at.support.first + i];
    }
    at.curves[curve] = value;
  }
  return at;
}

// How far a closure may be bent at a view angle. Cycles bends a normal back whose mirror direction
// of the viewer is not clear of the horizon: its height has to be .01, or .9 of the viewer's own.
double least_tilt(double cosine) {
  const double least_height = std::min(0.9 * cosine, 0.0105);
  return -std::tan((std::asin(cosine) - std::asin(least_height)) / 2);
}
// No bend reaches the viewer itself.
double greatest_tilt(double cosine, double sine) { return 0.8 * sine / cosine; }

// A shape within what Cycles can show, and which of its numbers were clipped.
struct ClippedShape {
  Shape shape;
  bool x_free, y_free, tilt_free;
};

ClippedShape shape_at(const AtView& at, const Layout& layout, int closure, double cosine) {
  const double m = at.curves[layout.shape(closure, mean)];
  const double h = at.curves[layout.shape(closure, spread)] * at.sine * at.sine;
  const double t = at.curves[layout.shape(closure, bend)] * at.sine;
  const auto clip = [](double value, double low, double high, bool& free) {
    free = value > low && value < high;
    return std::clamp(value, low, high);
  };
  ClippedShape result;
  result.shape.log_alpha_x = clip(m - h, least_log_alpha, 0, result.x_free);
  result.shape.log_alpha_y = clip(m + h, least_log_alpha, 0, result.y_free);
  result.shape.tilt = clip(t, least_tilt(cosine), greatest_tilt(cosine, at.sine), result.tilt_free);
  return result;
}

// |r| made smooth, sqrt(r^2 + e^2) - e, without loss of digits where r is small.
double smooth(double r, double e) { return r * r / (std::sqrt(r * r + e * e) + e); }

double view_error(const Problem& problem, const TargetView& view, const Eigen::VectorXd& x,
                  double smoothing) {
  const Layout& layout = problem.layout;
  const AtView at = at_view(x, view.wo.z());
  std::vector<Microfacet> closures;
  for (int k = 0; k < layout.specular; ++k) {
    closures.emplace_back(problem.distributions[static_cast<std::size_t>(k)],
                          shape_at(at, layout, k, view.wo.z()).shape, view.wo);
  }
  const auto weights = [&](int closure) {
    return Rgb(at.curves.segment<3>(layout.weight(closure, 0)).array());
  };
  double error = 0;
  for (const TargetLight& light : view.lights) {
    Rgb r = weights(layout.specular) * (light.wi.z() / pi) - light.reflected;
    for (int k = 0; k < layout.specular; ++k) {
      r += weights(k) * closures[static_cast<std::size_t>(k)].evaluate(light.wi, light.half);
    }
    const double e = smoothing * light.typical;
    error += light.weight * (smooth(r[0], e) + smooth(r[1], e) + smooth(r[2], e));
  }
  return error;
}

// Gradient and reweighted least squares' matrix of view_error by the curves' values at the view.
struct ViewEquations {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd gradient;
};

// The number of closures is known when this is compiled, so that its inner loops unroll.
template <int specular>
ViewEquations linearise_view(const Problem& problem, const TargetView& view,
                             const Eigen::VectorXd& x, double smoothing) {
  constexpr int own = shape_curves * specular + specular + 1;
  const Layout& layout = problem.layout;
  const AtView at = at_view(x, view.wo.z());
  const double sine = at.sine;
  std::vector<ClippedShape> shapes;
  std::vector<Microfacet> closures;
  for (int k = 0; k < specular; ++k) {
    shapes.push_back(shape_at(at, layout, k, view.wo.z()));
    closures.emplace_back(problem.distributions[static_cast<std::size_t>(k)], shapes.back().shape,
                          view.wo);
  }
  // One channel depends on the shapes and on its own weights: the equations of the three channels
  // are kept apart until all lights are in.
  using Matrix = Eigen::Matrix<double, own, own>;
  using Column = Eigen::Matrix<double, own, 1>;
  std::array<Matrix, 3> matrices;
  std::array<Column, 3> gradients;
  matrices.fill(Matrix::Zero());
  gradients.fill(Column::Zero());
  Column row;
  std::array<double, shape_curves * specular + 1> by_shape{};
  for (const TargetLight& light : view.lights) {
    for (int k = 0; k < specular; ++k) {
      const ClippedShape& shape = shapes[static_cast<std::size_t>(k)];
      const ShapeValue value =
          closures[static_cast<std::size_t>(k)].evaluate_with_derivatives(light.wi, light.half);
      const double by_x = shape.x_free ? value.by_log_alpha_x : 0;
      const double by_y = shape.y_free ? value.by_log_alpha_y : 0;
      double* const by = by_shape.data() + shape_curves * k;
      by[mean] = value.value * (by_x + by_y);
      by[spread] = value.value * (by_y - by_x) * sine * sine;
      by[bend] = shape.tilt_free ? value.value * value.by_tilt * sine : 0;
      row[shape_curves * specular + k] = value.value;
    }
    row[own - 1] = light.wi.z() / pi;
    for (int c = 0; c < 3; ++c) {
      double r = -light.reflected[c];
      for (int k = 0; k <= specular; ++k) {
        const double weight = at.curves[layout.weight(k, c)];
        r += weight * row[shape_curves * specular + k];
        for (int i = shape_curves * k; k < specular && i < shape_curves * (k + 1); ++i) {
          row[i] = weight * by_shape[static_cast<std::size_t>(i)];
        }
      }
      const double e = smoothing * light.typical;
      const double weight = light.weight / std::sqrt(r * r + e * e);
      auto& matrix = matrices[static_cast<std::size_t>(c)];
      for (int j = 0; j < own; ++j) {
        const double scaled = weight * row[j];
        for (int i = j; i < own; ++i) matrix(i, j) += scaled * row[i];
      }
      gradients[static_cast<std::size_t>(c)] += (weight * r) * row;
    }
  }
  ViewEquations sum{Eigen::MatrixXd::Zero(layout.curves(), layout.curves()),
                    Eigen::VectorXd::Zero(layout.curves())};
  for (int c = 0; c < 3; ++c) {
    const auto place = [&](int i) {
      return i < shape_curves * specular ? i : layout.weight(i - shape_curves * specular, c);
    };
    const auto& matrix = matrices[static_cast<std::size_t>(c)];
    for (int j = 0; j < own; ++j) {
      for (int i = j; i < own; ++i) sum.matrix(place(i), place(j)) += matrix(i, j);
      sum.gradient[place(j)] += gradients[static_cast<std::size_t>(c)][j];
    }
  }
  sum.matrix.triangularView<Eigen::StrictlyUpper>() = sum.matrix.transpose();
  return sum;
}

ViewEquations linearise_view(const Problem& problem, const TargetView& view,
                             const Eigen::VectorXd& x, double smoothing) {
  static_assert(most_specular_closures == 3);
  switch (problem.layout.specular) {
    case 0:
      return linearise_view<0>(problem, view, x, smoothing);
    case 1:
      return linearise_view<1>(problem, view, x, smoothing);
    case 2:
      return linearise_view<2>(problem, view, x, smoothing);
    default:
      return linearise_view<3>(problem, view, x, smoothing);
  }
}

// A little curvature costs a little error, so that curves are smooth where the target does not say:
// the square of second differences of the coefficients. Weights are counted in their own size.
constexpr double shape_stiffness = 3e-6, weight_stiffness = 3e-6;

struct Equations {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd gradient;
};

double stiffness_of(const Layout& layout, int curve) {
  return curve < shape_curves * layout.specular ? shape_stiffness : weight_stiffness;
}

double stiffness_penalty(const Layout& layout, const Eigen::VectorXd& x) {
  double penalty = 0;
  for (int curve = 0; curve < layout.curves(); ++curve) {
    for (int i = 1; i + 1 < n; ++i) {
      const double* at = x.data() + curve * n + i;
      const double bent = at[-1] - 2 * at[0] + at[1];
      penalty += stiffness_of(layout, curve) / 2 * bent * bent;
    }
  }
  return penalty;
}

void add_penalty(const Layout& layout, const Eigen::VectorXd& x, Equations& equations) {
  const Eigen::Vector3d difference(1, -2, 1);
  for (int curve = 0; curve < layout.curves(); ++curve) {
    const double stiffness = stiffness_of(layout, curve);
    for (int i = curve * n; i + 2 < (curve + 1) * n; ++i) {
      equations.matrix.block<3, 3>(i, i) += stiffness * difference * difference.transpose();
      equations.gradient.segment<3>(i) += stiffness * difference.dot(x.segment<3>(i)) * difference;
    }
  }
}

// Calls visit for every stride-th view of the problem.
template <typename Visitor>
void for_each_view(const Problem& problem, int stride, Visitor&& visit) {
  for (std::size_t i = 0; i < problem.target->size(); i += static_cast<std::size_t>(stride)) {
    visit((*problem.target)[i]);
  }
}

double smooth_error(const Problem& problem, int stride, const Eigen::VectorXd& x,
                    double smoothing) {
  double sum = 0;
  for_each_view(problem, stride,
                [&](const TargetView& view) { sum += view_error(problem, view, x, smoothing); });
  return stride * sum + stiffness_penalty(problem.layout, x);
}

Equations linearise(const Problem& problem, int stride, const Eigen::VectorXd& x,
                    double smoothing) {
  const int unknowns = problem.layout.unknowns(), curves = problem.layout.curves();
  Equations sum{Eigen::MatrixXd::Zero(unknowns, unknowns), Eigen::VectorXd::Zero(unknowns)};
  for_each_view(problem, stride, [&](const TargetView& view) {
    const ViewEquations part = linearise_view(problem, view, x, smoothing);
    const auto support = ViewSplines::at(view.wo.z());
    const Eigen::Map<const Eigen::Vector4d> share(support.share.data());
    const Eigen::Matrix4d both = stride * share * share.transpose();
    for (int q = 0; q < curves; ++q) {
      sum.gradient.segment<4>(q * n + support.first) += stride * part.gradient[q] * share;
      for (int p = 0; p < curves; ++p) {
        if (part.matrix(p, q) == 0) continue;
        sum.matrix.block<4, 4>(p * n + support.first, q * n + support.first) +=
            part.matrix(p, q) * both;
      }
    }
  });
  add_penalty(problem.layout, x, sum);
  return sum;
}

// A damped step within the bounds. An unknown at its bound stays there while the error falls
// outward.
Eigen::VectorXd step_from(const Eigen::VectorXd& x, const Bounds& bounds,
                          const Equations& equations, double damping) {
  std::vector<int> free;
  for (int i = 0; i < x.size(); ++i) {
    const bool held =
        equations.gradient[i] > 0 ? x[i] <= bounds.least[i] : x[i] >= bounds.greatest[i];
    if (!held && equations.matrix(i, i) > 0) free.push_back(i);
  }
  Eigen::MatrixXd matrix = equations.matrix(free, free);
  const Eigen::VectorXd gradient = equations.gradient(free);
  const Eigen::VectorXd scale = matrix.diagonal().cwiseSqrt().cwiseInverse();
  matrix = scale.asDiagonal() * matrix * scale.asDiagonal();
  matrix.diagonal().array() += damping;
  Eigen::VectorXd tried = x;
  tried(free) -= scale.cwiseProduct(matrix.llt().solve(scale.cwiseProduct(gradient)).eval());
  return tried.cwiseMax(bounds.least).cwiseMin(bounds.greatest);
}

// Levenberg and Marquardt's method on smooth_error.
Eigen::VectorXd descend(const Problem& problem, int stride, Eigen::VectorXd x, double smoothing,
                        int iterations, const Monitor& monitor) {
  const Bounds bounds = bounds_of(problem.layout);
  double error = smooth_error(problem, stride, x, smoothing), damping = 1e-3;
  for (int iteration = 0; iteration < iterations; ++iteration) {
    monitor.throw_if_cancelled();
    const Equations equations = linearise(problem, stride, x, smoothing);
    const double before = error;
    for (int attempt = 0; attempt < 6 && !(error < before); ++attempt) {
      const Eigen::VectorXd tried = step_from(x, bounds, equations, damping);
      const double tried_error = smooth_error(problem, stride, tried, smoothing);
      const bool better = tried_error < error;
      if (better) {
        x = tried;
        error = tried_error;
      }
      damping = std::max(1e-9, damping * (better ? 0.2 : 8));
    }
    if (!(error < before * (1 - 1e-4))) break;
  }
  return x;
}

struct Candidate {
  Problem problem;
  Eigen::VectorXd x;
  double error;
};

Eigen::VectorXd start_at(const Layout& layout, const std::vector<double>& alphas,
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
    const Layout layout{specular};
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
  const Layout& from = candidate.problem.layout;
  const Layout to{from.specular + 1};
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

ClosureSet to_closures(const Problem& problem, const Eigen::VectorXd& x, double tolerance,
                       const WeightFactors& factors) {
  const Layout& layout = problem.layout;
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
        const AtView at = at_view(x, inside);
        return to_sockets(shape_at(at, layout, k, inside).shape, {at.sine, 0, inside}).*socket;
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
