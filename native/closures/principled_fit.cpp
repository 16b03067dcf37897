#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "closures/principled.h"
#include "closures/principled_kernel.h"
#include "closures/principled_terms.inc"
#include "measurement/parallel.h"

namespace lobefit {
namespace {

// The unknowns are base colour, specular tint, metallic, ln(roughness) and (ior - 1) / (ior + 1).
enum Unknown { base, tint = 3, metallic = 6, log_roughness, root, unknowns };
using Vector = Eigen::Matrix<double, unknowns, 1>;
using Matrix = Eigen::Matrix<double, unknowns, unknowns>;

// A roughness below 0.0266 is a mirror to Cycles 4.2, which no sun shows; an ior of 99 reflects
// nearly all.
constexpr double least_roughness = 0.03;
constexpr double greatest_root = 0.98;

const Vector& least() {
  static const Vector bound = [] {
    Vector least = Vector::Zero();
    least[log_roughness] = std::log(least_roughness);
    return least;
  }();
  return bound;
}

const Vector& greatest() {
  static const Vector bound = [] {
    Vector greatest = Vector::Ones();
    greatest[log_roughness] = 0;
    greatest[root] = greatest_root;
    return greatest;
  }();
  return bound;
}

// The unknown that each of the slopes of a channel is by.
using OwnUnknowns = std::array<int, PrincipledSlopes::count>;
OwnUnknowns own_unknowns_of(int channel, int brightest_tint) {
  return {metallic, log_roughness, root, tint + brightest_tint, base + channel, tint + channel};
}

int brightest_tint(const Vector& x) {
  int brightest = 0;
  x.segment<3>(tint).maxCoeff(&brightest);
  return brightest;
}

// A view's lights, each amount in a column of its own, padded with black ones that weigh nothing.
class View {
 public:
  View() = default;
  // Of the lights one of `every_light`.
  View(const TargetView& view, std::size_t every_light) : n_wo_(view.wo.z()) {
    const std::size_t count = (view.lights.size() + every_light - 1) / every_light;
    constexpr std::size_t lanes = principled_kernel_lanes;
    columns_.resize(static_cast<Eigen::Index>((count + lanes - 1) / lanes * lanes), column_count);
    columns_.rowwise() = Row{1, 1, 0, 1, 0, 0, 0, 0, 1};
    for (std::size_t i = 0; i < count; ++i) {
      const TargetLight& light = view.lights[i * every_light];
      const FacetLight<double> at = facet_light(light.wi, light.half);
      columns_.row(static_cast<Eigen::Index>(i)) = Row{at.n_wi,
                                                       at.wi_h,
                                                       at.sin2_h,
                                                       at.cos2_h,
                                                       light.reflected[0],
                                                       light.reflected[1],
                                                       light.reflected[2],
                                                       light.weight,
                                                       light.typical};
    }
  }

  double n_wo() const { return n_wo_; }
  PrincipledKernelLights lights() const {
    const auto column = [&](int i) { return columns_.col(i).data(); };
    return {static_cast<std::size_t>(columns_.rows()),
            {column(0), column(1), column(2), column(3)},
            {column(4), column(5), column(6)},
            column(7),
            column(8)};
  }

 private:
  static constexpr int column_count = 9;
  using Row = Eigen::Array<double, 1, column_count>;
  double n_wo_ = 1;
  Eigen::Array<double, Eigen::Dynamic, column_count> columns_;
};

// Views, and how many threads share a sum over them.
struct Views {
  std::vector<const View*> all;
  int threads = 1;
};

// The middle one of the first `every` of a number of things, and every so many-th from there on.
std::vector<std::size_t> one_of(std::size_t every, std::size_t count) {
  std::vector<std::size_t> chosen;
  for (std::size_t i = std::min(every, count) / 2; i < count; i += every) chosen.push_back(i);
  return chosen;
}

// One of `every_view` views, and of its lights one of `every_light`.
std::vector<View> views_of(const Target& target, std::size_t every_view, std::size_t every_light,
                           int threads) {
  const std::vector<std::size_t> chosen = one_of(every_view, target.size());
  std::vector<View> views(chosen.size());
  parallel_for(static_cast<int>(chosen.size()), threads, [&](int i) {
    const auto at = static_cast<std::size_t>(i);
    views[at] = View(target[chosen[at]], every_light);
  });
  return views;
}

Views thin_out(const std::vector<View>& views, std::size_t every, int threads = 1) {
  Views some{{}, threads};
  for (const std::size_t v : one_of(every, views.size())) some.all.push_back(&views[v]);
  return some;
}

// The sum of what each view adds, in the order of the views whatever the number of threads.
template <typename Sum, typename OfView>
Sum sum_over_views(const Views& views, Sum sum, OfView&& of_view) {
  std::vector<Sum> parts(views.all.size(), sum);
  parallel_for(static_cast<int>(parts.size()), views.threads, [&](int v) {
    const auto at = static_cast<std::size_t>(v);
    parts[at] = of_view(*views.all[at]);
  });
  for (const Sum& part : parts) sum += part;
  return sum;
}

PrincipledKernelInput kernel_input(const View& view, const Vector& x, double smoothing) {
  const SharedSockets shared = {x[metallic], std::exp(x[log_roughness]), x[root],
                                x.segment<3>(tint).maxCoeff()};
  PrincipledKernelInput in{view.lights(), principled_terms(shared, view.n_wo()), {}, {}, smoothing};
  std::copy_n(x.data() + base, 3, in.base_color);
  std::copy_n(x.data() + tint, 3, in.specular_tint);
  return in;
}

// The distance to the target as error_of tells it, up to a factor where views or lights are left
// out, with |r| made smooth as sqrt(r^2 + e^2) - e, e = smoothing x typical.
double smooth_error(const Views& views, const Vector& x, double smoothing) {
  return sum_over_views(views, 0.0, [&](const View& view) {
    return run_principled_error(kernel_input(view, x, smoothing));
  });
}

// The gradient of smooth_error and the matrix of its iteratively reweighted least squares, by all
// unknowns.
struct NormalEquations {
  Matrix matrix = Matrix::Zero();
  Vector gradient = Vector::Zero();

  NormalEquations& operator+=(const NormalEquations& other) {
    matrix += other.matrix;
    gradient += other.gradient;
    return *this;
  }
};

NormalEquations linearise(const Views& views, const Vector& x, double smoothing) {
  const int brightest = brightest_tint(x);
  return sum_over_views(views, NormalEquations(), [&](const View& view) {
    const PrincipledKernelSums sums = run_principled_kernel(kernel_input(view, x, smoothing));
    NormalEquations equations;
    for (int c = 0; c < 3; ++c) {
      const OwnUnknowns own = own_unknowns_of(c, brightest);
      for (std::size_t j = 0; j < own.size(); ++j) {
        equations.gradient[own[j]] += sums.gradient[c][j];
        for (std::size_t i = 0; i < own.size(); ++i) {
          equations.matrix(own[i], own[j]) += sums.matrix[c][std::max(i, j)][std::min(i, j)];
        }
      }
    }
    return equations;
  });
}

// A damped step, within the bounds. An unknown at its bound stays there while the error falls
// outward, and so does one that no sample depends on (the base colour under a mirror, say).
Vector step_from(const Vector& x, const NormalEquations& equations, double damping) {
  Matrix matrix = equations.matrix;
  Vector gradient = equations.gradient;
  matrix.diagonal() *= 1 + damping;
  for (int i = 0; i < unknowns; ++i) {
    const bool held = gradient[i] > 0 ? x[i] <= least()[i] : x[i] >= greatest()[i];
    if (!held && equations.matrix(i, i) > 0) continue;
    matrix.row(i).setZero();
    matrix.col(i).setZero();
    matrix(i, i) = 1;
    gradient[i] = 0;
  }
  const Vector scale = matrix.diagonal().cwiseSqrt().cwiseInverse();
  const Matrix scaled = scale.asDiagonal() * matrix * scale.asDiagonal();
  const Vector step = -scale.cwiseProduct(scaled.ldlt().solve(scale.cwiseProduct(gradient)));
  return (x + step).cwiseMax(least()).cwiseMin(greatest());
}

// Levenberg and Marquardt's method on smooth_error.
Vector descend(const Views& views, Vector x, double smoothing, int iterations) {
  double error = smooth_error(views, x, smoothing), damping = 1e-2;
  for (int iteration = 0; iteration < iterations; ++iteration) {
    const NormalEquations equations = linearise(views, x, smoothing);
    const double before = error;
    for (int attempt = 0; attempt < 6 && !(error < before); ++attempt) {
      const Vector tried = step_from(x, equations, damping);
      const double tried_error = smooth_error(views, tried, smoothing);
      const bool better = tried_error < error;
      if (better) {
        x = tried;
        error = tried_error;
      }
      damping *= better ? 0.2 : 8;
    }
    if (!(error < before * (1 - 1e-5))) break;
  }
  return x;
}

// Calls visit(lights, i) for every light of a view but its padding.
template <typename Visitor>
void visit_lights(const View& view, Visitor&& visit) {
  const PrincipledKernelLights lights = view.lights();
  for (std::size_t i = 0; i < lights.count; ++i) {
    if (lights.weight[i] > 0) visit(lights, i);
  }
}

// The median colour of the target away from its highlight, as the albedo of a diffuse surface.
Rgb diffuse_albedo(const Views& views) {
  std::array<std::vector<double>, 3> values;
  for (const View* view : views.all) {
    visit_lights(*view, [&](const PrincipledKernelLights& lights, std::size_t i) {
      if (!(lights.at.cos2_h[i] < 0.6)) return;
      for (std::size_t c = 0; c < 3; ++c) {
        values[c].push_back(pi * lights.reflected[c][i] / lights.at.n_wi[i]);
      }
    });
  }
  Rgb albedo = Rgb::Constant(0.5);
  for (std::size_t c = 0; c < 3 && !values[c].empty(); ++c) {
    const auto middle = values[c].begin() + static_cast<std::ptrdiff_t>(values[c].size() / 2);
    std::nth_element(values[c].begin(), middle, values[c].end());
    albedo[static_cast<Eigen::Index>(c)] = std::clamp(*middle, 0.0, 1.0);
  }
  return albedo;
}

// The light that the target reflects.
Rgb reflected_light(const Views& views) {
  Rgb sum = Rgb::Zero();
  for (const View* view : views.all) {
    visit_lights(*view, [&](const PrincipledKernelLights& lights, std::size_t i) {
      for (int c = 0; c < 3; ++c) sum[c] += lights.weight[i] * lights.reflected[c][i];
    });
  }
  return sum;
}

// And that a white metal of this roughness would.
double white_metal_light(const Views& views, double roughness) {
  double sum = 0;
  for (const View* view : views.all) {
    const PrincipledTerms terms = principled_terms({1, roughness, 0, 1}, view->n_wo());
    visit_lights(*view, [&](const PrincipledKernelLights& lights, std::size_t i) {
      const FacetLight<double> at = {lights.at.n_wi[i], lights.at.wi_h[i], lights.at.sin2_h[i],
                                     lights.at.cos2_h[i]};
      sum += lights.weight[i] * ggx_lobe<false>(terms, at).value;
    });
  }
  return sum;
}

// Where the search begins, 32 points: from sharp to rough a dielectric over a diffuse surface, a
// metal, both in equal parts, and a coat so dense that its tint is the colour of a highlight that
// pales at grazing angles. The colours return the target's light.
std::vector<Vector> starts(const Views& views) {
  const Rgb albedo = diffuse_albedo(views), light = reflected_light(views);
  std::vector<Vector> all;
  for (const double roughness : {0.04, 0.07, 0.12, 0.2, 0.3, 0.45, 0.65, 0.9}) {
    const auto start = [&](const Rgb& base_color, const Rgb& specular_tint, double metal,
                           double reflectance_root) {
      Vector x;
      x << base_color.matrix(), specular_tint.matrix(), metal, std::log(roughness),
          reflectance_root;
      return x;
    };
    const Rgb metal = (light / white_metal_light(views, roughness)).cwiseMin(1);
    all.push_back(start(albedo, Rgb::Ones(), 0, 0.2));
    all.push_back(start(metal, Rgb::Constant(0.8), 1, 0.2));
    all.push_back(start((metal + albedo) / 2, Rgb::Constant(0.8), 0.5, 0.2));
    all.push_back(start(albedo, metal, 0, 0.9));
  }
  return all;
}

struct Candidate {
  Vector x;
  double error;
};

}  // namespace

Principled fit_principled(const Target& target, int requested_threads) {
  if (target.empty()) return {};
  const int threads = thread_count(requested_threads);
  const std::vector<View> thin = views_of(target, 12, 3, threads),
                          whole = views_of(target, 1, 1, threads);
  const Views few = thin_out(thin, 1), some = thin_out(whole, 12),
              half = thin_out(whole, 2, threads), all = thin_out(whole, 1, threads);
  std::vector<Candidate> found;
  for (const Vector& start : starts(few)) found.push_back({start, 0});
  // Follows every candidate and keeps the best few.
  const auto follow = [&](const Views& views, double smoothing, int iterations, std::size_t kept) {
    parallel_for(static_cast<int>(found.size()), threads, [&](int i) {
      Candidate& candidate = found[static_cast<std::size_t>(i)];
      candidate.x = descend(views, candidate.x, smoothing, iterations);
      candidate.error = smooth_error(views, candidate.x, 0);
    });
    std::stable_sort(found.begin(), found.end(),
                     [](const Candidate& a, const Candidate& b) { return a.error < b.error; });
    found.resize(std::min(found.size(), kept), found.front());
  };
  follow(few, 0.1, 4, 8);
  follow(few, 0.03, 8, 4);
  follow(some, 0.03, 8, 2);
  follow(some, 0.01, 10, 1);
  follow(half, 0.003, 10, 1);
  const Vector& best = found.front().x;
  Principled result;
  result.base_color = best.segment<3>(base).array();
  result.specular_tint = best.segment<3>(tint).array();
  result.metallic = best[metallic];
  result.roughness = std::exp(best[log_roughness]);
  result.ior = (1 + best[root]) / (1 - best[root]);
  result.error = smooth_error(all, best, 0);
  return result;
}

}  // namespace lobefit
