#include "closures/closure_problem.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace lobefit {
namespace {

using enum ClosureLayout::ShapeCurve;

// Cycles 4.2 takes anything with alpha_x alpha_y below 5e-7 for a mirror, and single precision
// loses the peak of a lobe much narrower than this.
const double least_log_alpha = std::log(0.002);

struct Bounds {
  Eigen::VectorXd least, greatest;
};

Bounds bounds_of(const ClosureLayout& layout) {
  Bounds bounds{Eigen::VectorXd::Zero(layout.unknowns()),
                Eigen::VectorXd::Constant(layout.unknowns(), 1e6)};
  const int n = layout.coefficients;
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

// The values of all curves at one view angle.
struct AtView {
  Eigen::VectorXd curves;
  double sine;
};

AtView at_view(const ClosureCurves& closures, double cosine) {
  const ClosureLayout& layout = closures.layout;
  const auto [first, share] = ViewSplines::at(cosine, layout.coefficients);
  const Eigen::Map<const Eigen::MatrixXd> coefficients(closures.x.data(), layout.coefficients,
                                                       layout.curves());
  return {coefficients.middleRows(first, share.size()).transpose() * share,
          std::sqrt(std::max(0.0, 1 - cosine * cosine))};
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

ClippedShape clipped_shape(const AtView& at, const ClosureLayout& layout, int closure,
                           double cosine) {
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

Microfacet microfacet(const ClosureCurves& closures, int closure, const Shape& shape,
                      const Vector3& wo) {
  return {closures.distributions[static_cast<std::size_t>(closure)], shape, wo};
}

double view_error(const ClosureCurves& closures, const TargetView& view, double smoothing) {
  const ClosureLayout& layout = closures.layout;
  const AtView at = at_view(closures, view.wo.z());
  std::vector<Microfacet> specular;
  for (int k = 0; k < layout.specular; ++k) {
    const Shape shape = clipped_shape(at, layout, k, view.wo.z()).shape;
    specular.push_back(microfacet(closures, k, shape, view.wo));
  }
  const auto weights = [&](int closure) {
    return Rgb(at.curves.segment<3>(layout.weight(closure, 0)).array());
  };
  double error = 0;
  for (const TargetLight& light : view.lights) {
    Rgb r = weights(layout.specular) * (light.wi.z() / pi) - light.reflected;
    for (int k = 0; k < layout.specular; ++k) {
      r += weights(k) * specular[static_cast<std::size_t>(k)].evaluate(light.wi, light.half);
    }
    const double e = smoothing * light.typical;
    error += light.weight * (smooth(r[0], e) + smooth(r[1], e) + smooth(r[2], e));
  }
  return error;
}

// Gradient and reweighted least squares' matrix, its lower half, of view_error by the curves'
// values at the view.
struct ViewEquations {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd gradient;
};

// The number of closures is known when this is compiled, so that its inner loops unroll.
template <int specular>
ViewEquations linearise_view(const ClosureCurves& closures, const TargetView& view,
                             double smoothing) {
  constexpr int own = shape_curves * specular + specular + 1;
  const ClosureLayout& layout = closures.layout;
  const AtView at = at_view(closures, view.wo.z());
  const double sine = at.sine;
  std::vector<ClippedShape> shapes;
  std::vector<Microfacet> microfacets;
  for (int k = 0; k < specular; ++k) {
    shapes.push_back(clipped_shape(at, layout, k, view.wo.z()));
    microfacets.push_back(microfacet(closures, k, shapes.back().shape, view.wo));
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
          microfacets[static_cast<std::size_t>(k)].evaluate_with_derivatives(light.wi, light.half);
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
  return sum;
}

ViewEquations linearise_view(const ClosureCurves& closures, const TargetView& view,
                             double smoothing) {
  static_assert(most_specular_closures == 3);
  switch (closures.layout.specular) {
    case 0:
      return linearise_view<0>(closures, view, smoothing);
    case 1:
      return linearise_view<1>(closures, view, smoothing);
    case 2:
      return linearise_view<2>(closures, view, smoothing);
    default:
      return linearise_view<3>(closures, view, smoothing);
  }
}

// A little curvature costs a little error, so that curves are smooth where the target does not say:
// the square of second differences of the coefficients. Weights are counted in their own size.
constexpr double stiffness = 1e-5;

// Splines of half the width have twice as many second differences for the same curve, each a
// quarter as large: they count eight times as much, that its cost stays the same.
double stiffness_of(const ClosureLayout& layout) {
  return stiffness * std::pow((layout.coefficients - 3.0) / (ViewSplines::coarse - 3.0), 3);
}

double stiffness_penalty(const ClosureCurves& closures) {
  const ClosureLayout& layout = closures.layout;
  const int n = layout.coefficients;
  double penalty = 0;
  for (int curve = 0; curve < layout.curves(); ++curve) {
    for (int i = 1; i + 1 < n; ++i) {
      const double* at = closures.x.data() + curve * n + i;
      penalty += square(at[-1] - 2 * at[0] + at[1]);
    }
  }
  return stiffness_of(layout) / 2 * penalty;
}

struct Equations {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd gradient;
};

void add_penalty(const ClosureCurves& closures, Equations& equations) {
  const ClosureLayout& layout = closures.layout;
  const int n = layout.coefficients;
  const Eigen::Vector3d difference(1, -2, 1);
  const Eigen::Matrix3d both = stiffness_of(layout) * difference * difference.transpose();
  for (int curve = 0; curve < layout.curves(); ++curve) {
    for (int i = curve * n; i + 2 < (curve + 1) * n; ++i) {
      equations.matrix.block<3, 3>(i, i) += both;
      equations.gradient.segment<3>(i) += both * closures.x.segment<3>(i);
    }
  }
}

// Of the matrix the lower half.
void linearise(const Target& target, const ClosureCurves& closures, double smoothing,
               Equations& sum) {
  const ClosureLayout& layout = closures.layout;
  const int unknowns = layout.unknowns(), curves = layout.curves(), n = layout.coefficients;
  sum.matrix.setZero(unknowns, unknowns);
  sum.gradient.setZero(unknowns);
  for (const TargetView& view : target) {
    const ViewEquations part = linearise_view(closures, view, smoothing);
    if (n == 1) {
      sum.matrix += part.matrix;
      sum.gradient += part.gradient;
      continue;
    }
    const auto support = ViewSplines::at(view.wo.z(), n);
    const Eigen::Vector4d share = support.share;
    const Eigen::Matrix4d both = share * share.transpose();
    for (int q = 0; q < curves; ++q) {
      const int column = q * n + support.first;
      sum.gradient.segment<4>(column) += part.gradient[q] * share;
      for (int p = q; p < curves; ++p) {
        if (part.matrix(p, q) == 0) continue;
        sum.matrix.block<4, 4>(p * n + support.first, column) += part.matrix(p, q) * both;
      }
    }
  }
  add_penalty(closures, sum);
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
  const auto count = static_cast<Eigen::Index>(free.size());
  const Eigen::VectorXd scale = equations.matrix.diagonal()(free).cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd matrix(count, count);
  for (Eigen::Index j = 0; j < count; ++j) {
    const double* const column = &equations.matrix(0, free[static_cast<std::size_t>(j)]);
    for (Eigen::Index i = j; i < count; ++i) {
      matrix(i, j) = scale[i] * scale[j] * column[free[static_cast<std::size_t>(i)]];
    }
    matrix(j, j) += damping;
  }
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factors(matrix);  // in place
  Eigen::VectorXd tried = x;
  tried(free) -=
      scale.cwiseProduct(factors.solve(scale.cwiseProduct(equations.gradient(free)).eval()).eval());
  return tried.cwiseMax(bounds.least).cwiseMin(bounds.greatest);
}

}  // namespace

ClosureCurves subdivided(const ClosureCurves& closures) {
  ClosureCurves finer = closures;
  const int from = closures.layout.coefficients;
  const int to = finer.layout.coefficients = 2 * from - 3;
  finer.x.resize(finer.layout.unknowns());
  for (int curve = 0; curve < finer.layout.curves(); ++curve) {
    finer.x.segment(curve * to, to) =
        ViewSplines::subdivided(closures.x.segment(curve * from, from));
  }
  return finer;
}

ClosureCurves constant_at(const ClosureCurves& closures, double cosine) {
  return {{closures.layout.specular, 1}, closures.distributions, at_view(closures, cosine).curves};
}

Shape shape_at(const ClosureCurves& closures, int closure, double cosine) {
  return clipped_shape(at_view(closures, cosine), closures.layout, closure, cosine).shape;
}

Eigen::VectorXd light_of_closures(const TargetView& view, const ClosureCurves& closures) {
  const ClosureLayout& layout = closures.layout;
  const AtView at = at_view(closures, view.wo.z());
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(layout.specular);
  for (int k = 0; k < layout.specular; ++k) {
    const Shape shape = clipped_shape(at, layout, k, view.wo.z()).shape;
    const Microfacet closure = microfacet(closures, k, shape, view.wo);
    for (const TargetLight& light : view.lights) {
      sum[k] += light.weight * closure.evaluate(light.wi, light.half);
    }
    sum[k] *= at.curves.segment<3>(layout.weight(k, 0)).sum();
  }
  return sum;
}

double smooth_error(const Target& target, const ClosureCurves& closures, double smoothing) {
  double sum = 0;
  for (const TargetView& view : target) sum += view_error(closures, view, smoothing);
  return sum + stiffness_penalty(closures);
}

ClosureCurves descend(const Target& target, ClosureCurves closures, double smoothing,
                      int iterations, const Monitor& monitor) {
  const Bounds bounds = bounds_of(closures.layout);
  double error = smooth_error(target, closures, smoothing), damping = 1e-3;
  ClosureCurves tried = closures;
  Equations equations;
  for (int iteration = 0; iteration < iterations; ++iteration) {
    monitor.throw_if_cancelled();
    linearise(target, closures, smoothing, equations);
    const double before = error;
    for (int attempt = 0; attempt < 6 && !(error < before); ++attempt) {
      tried.x = step_from(closures.x, bounds, equations, damping);
      const double tried_error = smooth_error(target, tried, smoothing);
      const bool better = tried_error < error;
      if (better) {
        closures.x = tried.x;
        error = tried_error;
      }
      damping = std::max(1e-9, damping * (better ? 0.2 : 8));
    }
    if (!(error < before * (1 - 1e-4))) break;
  }
  return closures;
}

}  // namespace lobefit
