#include <ceres/jet.h>

#include <Eigen/Cholesky>
#include <vector>

#include "closures/principled.h"
#include "closures/principled_terms.h"
#include "measurement/half_difference.h"

namespace lobefit {
namespace {

constexpr int unknowns = 9;
using Vector = Eigen::Matrix<double, unknowns, 1>;
using Matrix = Eigen::Matrix<double, unknowns, unknowns>;
// One derivative more than needed: Eigen handles an even number of doubles twice as fast.
using Dual = ceres::Jet<double, unknowns + 1>;

// The unknowns are base colour, specular tint, metallic, ln(roughness) and (ior - 1) / (ior + 1).
// A roughness below 0.0266 is a mirror to Cycles 4.2, which no sun shows; an ior of 99 reflects
// nearly all.
constexpr double least_roughness = 0.03;
constexpr double greatest_root = 0.98;

Vector least() {
  Vector bound = Vector::Zero();
  bound[7] = std::log(least_roughness);
  return bound;
}

Vector greatest() {
  Vector bound = Vector::Ones();
  bound[7] = 0;
  bound[8] = greatest_root;
  return bound;
}

template <typename T>
PrincipledSockets<T> sockets_of(const std::array<T, unknowns>& x) {
  using std::exp;
  return {{x[0], x[1], x[2]}, {x[3], x[4], x[5]}, x[6], exp(x[7]), x[8]};
}

// A pair of directions, what the target reflects there (f cos), and what a difference of 1 there
// adds to the error. typical is the mean of the target's channels at the same light angle.
struct Sample {
  FacetGeometry at;
  Rgb target;
  double weight;
  double typical;
};
using Samples = std::vector<Sample>;

// The spheres of one angle between light and viewer, sampled around the highlight: rings of half
// vectors that crowd toward the normal as the cube of their number, each weighted by its share of
// the sphere's picture. Empty where nothing is known or all is black.
Samples sample_sphere(const Reflectance& target, double theta_d) {
  constexpr int rings = 24, sectors = 8;
  // What is seen at a flatter angle is a hundredth of the sphere's picture.
  const double least_n_wo = std::cos(radians(84));
  // What is darker on the mean is black, and what is brighter could make sums infinite; no
  // reflectance comes near either.
  constexpr double darkest = 1e-12, brightest = 1e30;
  Samples samples;
  double area = 0, light = 0;
  for (int ring = 0; ring < rings; ++ring) {
    const auto edge = [](int number) {
      const double part = double(number) / rings;
      return part * part * part * (pi / 2);
    };
    const double theta_h = (edge(ring) + edge(ring + 1)) / 2;
    const double width = std::cos(edge(ring)) - std::cos(edge(ring + 1));
    for (int sector = 0; sector < sectors; ++sector) {
      // A quarter of a step off, no azimuth is the mirror image of another.
      const double phi_d = (sector + 0.25) / sectors * (2 * pi);
      const auto [wi, wo] = to_directions({theta_h, theta_d, phi_d});
      if (wi.z() <= 0 || wo.z() < least_n_wo) continue;
      const Rgb value = target(wi, wo) * wi.z();
      if (!value.isFinite().all()) continue;
      samples.push_back(
          {facet_geometry(wi, wo), value.cwiseMin(brightest).cwiseMax(0), width * wo.z(), 0});
      area += samples.back().weight;
      light += samples.back().weight * samples.back().target.sum();
    }
  }
  if (!(light > darkest * area)) return {};
  for (Sample& sample : samples) {
    sample.weight /= light;
    sample.typical = light / (3 * area);
  }
  return samples;
}

// Spheres of 20 light angles; the weights add up so that black has the error 1.
Samples sample_target(const Reflectance& target) {
  constexpr int spheres = 20;
  Samples all;
  int used = 0;
  for (int sphere = 0; sphere < spheres; ++sphere) {
    const Samples samples = sample_sphere(target, radians(85.0 * (sphere + 0.5) / spheres));
    all.insert(all.end(), samples.begin(), samples.end());
    used += !samples.empty();
  }
  for (Sample& sample : all) sample.weight /= used;
  return all;
}

Rgb reflect(const Vector& x, const FacetGeometry& at) {
  std::array<double, unknowns> values;
  Eigen::Map<Vector>(values.data()) = x;
  return Rgb(principled_terms(sockets_of(values), at).data());
}

// The relative L1 distance to the samples.
double error_of(const Samples& samples, const Vector& x) {
  double sum = 0;
  for (const Sample& sample : samples) {
    sum += sample.weight * (reflect(x, sample.at) - sample.target).abs().sum();
  }
  return sum;
}

// The same with |r| made smooth as sqrt(r^2 + e^2) - e, e = smoothing x typical.
double smooth_error(const Samples& samples, const Vector& x, double smoothing) {
  double sum = 0;
  for (const Sample& sample : samples) {
    const double e = smoothing * sample.typical;
    const Rgb r = (reflect(x, sample.at) - sample.target) / e;
    // r^2 / (sqrt(r^2 + 1) + 1) keeps its digits where r is small.
    sum += sample.weight * e * (r.square() / ((r.square() + 1).sqrt() + 1)).sum();
  }
  return sum;
}

// Gradient of smooth_error and the matrix of its iteratively reweighted least squares.
struct NormalEquations {
  Matrix matrix;
  Vector gradient;
};

NormalEquations linearise(const Samples& samples, const Vector& x, double smoothing) {
  std::array<Dual, unknowns> duals;
  for (int i = 0; i < unknowns; ++i) duals[static_cast<std::size_t>(i)] = Dual(x[i], i);
  const auto sockets = sockets_of(duals);
  Eigen::Matrix<double, Dual::DIMENSION, Dual::DIMENSION> matrix;
  Eigen::Matrix<double, Dual::DIMENSION, 1> gradient;
  matrix.setZero();
  gradient.setZero();
  for (const Sample& sample : samples) {
    const auto values = principled_terms(sockets, sample.at);
    for (int c = 0; c < 3; ++c) {
      const Dual& value = values[static_cast<std::size_t>(c)];
      const double r = value.a - sample.target[c];
      const double weight =
          sample.weight / std::sqrt(square(r) + square(smoothing * sample.typical));
      matrix.noalias() += (weight * value.v) * value.v.transpose();
      gradient += (weight * r) * value.v;
    }
  }
  return {matrix.topLeftCorner<unknowns, unknowns>(), gradient.head<unknowns>()};
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
Vector descend(const Samples& samples, Vector x, double smoothing, int iterations) {
  double error = smooth_error(samples, x, smoothing), damping = 1e-2;
  for (int iteration = 0; iteration < iterations; ++iteration) {
    const NormalEquations equations = linearise(samples, x, smoothing);
    const double before = error;
    for (int attempt = 0; attempt < 6 && !(error < before); ++attempt) {
      const Vector tried = step_from(x, equations, damping);
      const double tried_error = smooth_error(samples, tried, smoothing);
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
Rgb diffuse_albedo(const Samples& samples) {
  Rgb albedo;
  for (int c = 0; c < 3; ++c) {
    std::vector<double> values;
    for (const Sample& sample : samples) {
      if (sample.at.cos2_h < 0.6) values.push_back(pi * sample.target[c] / sample.at.n_wi);
    }
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    albedo[c] = values.empty() ? 0.5 : std::clamp(*middle, 0.0, 1.0);
  }
  return albedo;
}

// Where the search begins: from sharp to rough a dielectric over a diffuse surface, a metal, both
// in equal parts, and a coat so dense that its tint is the colour of a highlight that pales at
// grazing angles. The colours return the target's light.
std::vector<Vector> starts(const Samples& samples) {
  const Rgb albedo = diffuse_albedo(samples);
  std::vector<Vector> all;
  for (const double roughness : {0.05, 0.12, 0.3, 0.7}) {
    const auto start = [&](const Rgb& base, const Rgb& tint, double metallic, double root) {
      Vector x;
      x << base.matrix(), tint.matrix(), metallic, std::log(roughness), root;
      return x;
    };
    const Vector white = start(Rgb::Ones(), Rgb::Ones(), 1, 0.2);
    Rgb wanted = Rgb::Zero(), given = Rgb::Zero();
    for (const Sample& sample : samples) {
      wanted += sample.weight * sample.target;
      given += sample.weight * reflect(white, sample.at);
    }
    const Rgb metal = (wanted / given).cwiseMin(1);
    all.push_back(start(albedo, Rgb::Ones(), 0, 0.2));
    all.push_back(start(metal, Rgb::Constant(0.8), 1, 0.2));
    all.push_back(start((metal + albedo) / 2, Rgb::Constant(0.8), 0.5, 0.2));
    all.push_back(start(albedo, metal, 0, 0.9));
  }
  return all;
}

}  // namespace

Principled fit_principled(const Reflectance& target) {
  const Samples samples = sample_target(target);
  if (samples.empty()) return {};
  // Every start is followed a little way on a part of the samples, the nearest few further, and the
  // nearest to its end on all of them.
  Samples few;
  for (std::size_t i = 0; i < samples.size(); i += 5) few.push_back(samples[i]);
  std::vector<std::pair<double, Vector>> found;
  for (const Vector& start : starts(few)) found.emplace_back(0, start);
  const auto follow = [&](double smoothing, int iterations) {
    for (auto& [error, x] : found) {
      x = descend(few, x, smoothing, iterations);
      error = error_of(few, x);
    }
    std::sort(found.begin(), found.end(),
              [](const auto& a, const auto& b) { return a.first < b.first; });
  };
  follow(0.1, 5);
  found.resize(4);
  follow(0.03, 10);
  Vector best = found.front().second;
  for (const double smoothing : {0.03, 0.003}) best = descend(samples, best, smoothing, 10);
  Principled result;
  result.base_color = best.segment<3>(0).array();
  result.specular_tint = best.segment<3>(3).array();
  result.metallic = best[6];
  result.roughness = std::exp(best[7]);
  result.ior = (1 + best[8]) / (1 - best[8]);
  result.error = error_of(samples, best);
  return result;
}

}  // namespace lobefit
