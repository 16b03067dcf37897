#include <ceres/jet.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <vector>

#include "closures/principled.h"
#include "closures/principled_terms.h"
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

// One channel depends on the four shared sockets and two of its own, in this order.
constexpr int shared_unknowns = 4, own_unknowns = shared_unknowns + 2;
using SharedDual = ceres::Jet<double, shared_unknowns>;
using ColourDual = ceres::Jet<double, 2>;
// What depends on one socket alone is differentiated by it alone.
using OwnDual = ceres::Jet<double, 1>;

// The unknown that each of them is.
using OwnUnknowns = std::array<int, own_unknowns>;
OwnUnknowns own_unknowns_of(int channel, int brightest_tint) {
  return {metallic, log_roughness, root, tint + brightest_tint, base + channel, tint + channel};
}

int brightest_tint(const Vector& x) {
  int brightest = 0;
  x.segment<3>(tint).maxCoeff(&brightest);
  return brightest;
}

// A light of the target, and the lights of a view.
struct Sample {
  FacetGeometry at;
  Rgb target;
  double weight;
  double typical;
};
struct View {
  double n_wo;
  std::vector<Sample> samples;
};

// Views, and how many threads share a sum over them.
struct Views {
  std::vector<View> all;
  int threads = 1;
};

// One of `every_view` views, and of its lights one of `every_light`.
Views thin_out(const Target& target, std::size_t every_view, std::size_t every_light,
               int threads = 1) {
  Views views{{}, threads};
  const std::size_t first_view = std::min(every_view, target.size()) / 2;
  for (std::size_t v = first_view; v < target.size(); v += every_view) {
    const TargetView& from = target[v];
    View view{from.wo.z(), {}};
    for (std::size_t i = 0; i < from.lights.size(); i += every_light) {
      const TargetLight& light = from.lights[i];
      view.samples.push_back(
          {facet_geometry(light.wi, from.wo), light.reflected, light.weight, light.typical});
    }
    views.all.push_back(std::move(view));
  }
  return views;
}

// The sum of what each view adds, in the order of the views whatever the number of threads.
template <typename Sum, typename OfView>
Sum sum_over_views(const Views& views, Sum sum, OfView&& of_view) {
  std::vector<Sum> parts(views.all.size(), sum);
  parallel_for(static_cast<int>(parts.size()), views.threads, [&](int v) {
    const auto at = static_cast<std::size_t>(v);
    parts[at] = of_view(views.all[at]);
  });
  for (const Sum& part : parts) sum += part;
  return sum;
}

// The sum of an amount over all samples, given what the sockets reflect there.
template <typename Sum, typename Amount>
Sum sum_over(const Views& views, const Vector& x, const Sum& zero, Amount&& amount) {
  const SharedSockets<double> shared = {x[metallic], std::exp(x[log_roughness]), x[root],
                                        x.segment<3>(tint).maxCoeff()};
  return sum_over_views(views, zero, [&](const View& view) {
    Sum sum = zero;
    const auto at_view = principled_at_view(shared, view.n_wo);
    for (const Sample& sample : view.samples) {
      const auto light = principled_at_light(shared, at_view, sample.at);
      Rgb reflected;
      for (int c = 0; c < 3; ++c) {
        reflected[c] = principled_channel(light, x[base + c], x[tint + c]);
      }
      sum += amount(sample, reflected);
    }
    return sum;
  });
}

// The distance to the target by error_of, up to a factor where views or lights are left out.
double error_of(const Views& views, const Vector& x) {
  return sum_over(views, x, 0.0, [](const Sample& sample, const Rgb& reflected) {
    return sample.weight * (reflected - sample.target).abs().sum();
  });
}

// The same with |r| made smooth as sqrt(r^2 + e^2) - e, e = smoothing x typical.
double smooth_error(const Views& views, const Vector& x, double smoothing) {
  return sum_over(views, x, 0.0, [smoothing](const Sample& sample, const Rgb& reflected) {
    const double e = smoothing * sample.typical;
    const Rgb r2 = (reflected - sample.target).square();
    // r^2 / (sqrt(r^2 + e^2) + e) keeps its digits where r is small.
    return sample.weight * (r2 / ((r2 + e * e).sqrt() + e)).sum();
  });
}

// Of each channel, by its own unknowns: the gradient of smooth_error and the matrix of its
// iteratively reweighted least squares.
struct ChannelEquations {
  std::array<Eigen::Matrix<double, own_unknowns, own_unknowns>, 3> matrices;
  std::array<Eigen::Matrix<double, own_unknowns, 1>, 3> gradients;

  ChannelEquations() {
    for (auto& matrix : matrices) matrix.setZero();
    for (auto& gradient : gradients) gradient.setZero();
  }
  ChannelEquations& operator+=(const ChannelEquations& other) {
    for (std::size_t c = 0; c < 3; ++c) {
      matrices[c] += other.matrices[c];
      gradients[c] += other.gradients[c];
    }
    return *this;
  }
};

// The same by all unknowns.
struct NormalEquations {
  Matrix matrix = Matrix::Zero();
  Vector gradient = Vector::Zero();
};

// principled_channel, and its derivatives: those by shared sockets come from what the channels
// share, those by the two colours from the metal's Fresnel term alone.
double differentiate_channel(const PrincipledAtLight<SharedDual>& light, double base_color,
                             double specular_tint,
                             Eigen::Matrix<double, own_unknowns, 1>& derivatives) {
  const ColourDual fresnel =
      metal_fresnel(ColourDual(base_color, 0), ColourDual(specular_tint, 1), light.wi_h);
  const SharedDual value = principled_sum(light, fresnel.a, base_color, specular_tint);
  derivatives << value.v, light.metal.a * fresnel.v[0] + light.diffuse.a,
      light.metal.a * fresnel.v[1] + light.dielectric.a;
  return value.a;
}

SharedDual as_shared(const OwnDual& value, int unknown) {
  SharedDual shared(value.a);
  shared.v[unknown] = value.v[0];
  return shared;
}

NormalEquations linearise(const Views& views, const Vector& x, double smoothing) {
  using std::exp;
  const int brightest = brightest_tint(x);
  const OwnDual roughness = exp(OwnDual(x[log_roughness], 0)), own_root(x[root], 0);
  const SharedSockets<SharedDual> shared = {SharedDual(x[metallic], 0), as_shared(roughness, 1),
                                            SharedDual(x[root], 2),
                                            SharedDual(x[tint + brightest], 3)};
  const auto of_view = [&](const View& view) {
    ChannelEquations sums;
    Eigen::Matrix<double, own_unknowns, 1> slope;
    const auto at_view = principled_at_view(shared, view.n_wo);
    const OwnDual masking = ggx_masking(roughness, view.n_wo);
    for (const Sample& sample : view.samples) {
      const auto light = principled_at_light(shared, at_view, sample.at,
                                             as_shared(schlick_weight(own_root, sample.at.wi_h), 2),
                                             as_shared(ggx_lobe(roughness, masking, sample.at), 1));
      const double e = smoothing * sample.typical;
      for (std::size_t c = 0; c < 3; ++c) {
        const auto channel = static_cast<Eigen::Index>(c);
        const double value =
            differentiate_channel(light, x[base + channel], x[tint + channel], slope);
        const double r = value - sample.target[channel];
        const double weight = sample.weight / std::sqrt(r * r + e * e);
        sums.matrices[c].noalias() += (weight * slope) * slope.transpose();
        sums.gradients[c] += (weight * r) * slope;
      }
    }
    return sums;
  };
  const ChannelEquations sums = sum_over_views(views, ChannelEquations(), of_view);
  NormalEquations equations;
  for (std::size_t c = 0; c < 3; ++c) {
    const OwnUnknowns own = own_unknowns_of(static_cast<int>(c), brightest);
    for (int j = 0; j < own_unknowns; ++j) {
      const int column = own[static_cast<std::size_t>(j)];
      equations.gradient[column] += sums.gradients[c][j];
      for (int i = 0; i < own_unknowns; ++i) {
        equations.matrix(own[static_cast<std::size_t>(i)], column) += sums.matrices[c](i, j);
      }
    }
  }
  return equations;
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

// The median colour of the target away from its highlight, as the albedo of a diffuse surface.
Rgb diffuse_albedo(const Views& views) {
  Rgb albedo;
  for (int c = 0; c < 3; ++c) {
    std::vector<double> values;
    for (const View& view : views.all) {
      for (const Sample& sample : view.samples) {
        if (sample.at.cos2_h < 0.6) values.push_back(pi * sample.target[c] / sample.at.n_wi);
      }
    }
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    albedo[c] = values.empty() ? 0.5 : std::clamp(*middle, 0.0, 1.0);
  }
  return albedo;
}

// Where the search begins, 32 points: from sharp to rough a dielectric over a diffuse surface, a
// metal, both in equal parts, and a coat so dense that its tint is the colour of a highlight that
// pales at grazing angles. The colours return the target's light.
std::vector<Vector> starts(const Views& views) {
  const Rgb albedo = diffuse_albedo(views);
  std::vector<Vector> all;
  for (const double roughness : {0.04, 0.07, 0.12, 0.2, 0.3, 0.45, 0.65, 0.9}) {
    const auto start = [&](const Rgb& base_color, const Rgb& specular_tint, double metal,
                           double reflectance_root) {
      Vector x;
      x << base_color.matrix(), specular_tint.matrix(), metal, std::log(roughness),
          reflectance_root;
      return x;
    };
    const Vector white = start(Rgb::Ones(), Rgb::Ones(), 1, 0.2);
    using Both = Eigen::Array<double, 3, 2>;  // wanted, given
    const Both light = sum_over(views, white, Both(Both::Zero()),
                                [](const Sample& sample, const Rgb& reflected) -> Both {
                                  Both both;
                                  both << sample.weight * sample.target, sample.weight * reflected;
                                  return both;
                                });
    const Rgb metal = (light.col(0) / light.col(1)).cwiseMin(1);
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

Principled fit_principled(const Target& target, int threads) {
  if (target.empty()) return {};
  const Views few = thin_out(target, 12, 3), some = thin_out(target, 12, 1),
              all = thin_out(target, 2, 1, thread_count(threads));
  std::vector<Candidate> found;
  for (const Vector& start : starts(few)) found.push_back({start, 0});
  // Follows every candidate and keeps the best few.
  const auto follow = [&](const Views& views, double smoothing, int iterations, std::size_t kept) {
    parallel_for(static_cast<int>(found.size()), thread_count(threads), [&](int i) {
      Candidate& candidate = found[static_cast<std::size_t>(i)];
      candidate.x = descend(views, candidate.x, smoothing, iterations);
      candidate.error = error_of(views, candidate.x);
    });
    std::stable_sort(found.begin(), found.end(),
                     [](const Candidate& a, const Candidate& b) { return a.error < b.error; });
    found.resize(std::min(found.size(), kept), found.front());
  };
  follow(few, 0.1, 4, 8);
  follow(few, 0.03, 8, 4);
  follow(some, 0.03, 8, 2);
  follow(some, 0.01, 10, 1);
  follow(all, 0.003, 10, 1);
  const Vector& best = found.front().x;
  Principled result;
  result.base_color = best.segment<3>(base).array();
  result.specular_tint = best.segment<3>(tint).array();
  result.metallic = best[metallic];
  result.roughness = std::exp(best[log_roughness]);
  result.ior = (1 + best[root]) / (1 - best[root]);
  result.error = error_of(target, [&](const Vector3& wi, const Vector3& wo) {
    return evaluate_principled(result, wi, wo);
  });
  return result;
}

}  // namespace lobefit
