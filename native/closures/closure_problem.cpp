#include "closures/closure_problem.h"

#include <algorithm>
#include <cmath>

#include "closures/band_matrix.h"
#include "closures/closure_kernel.h"

namespace lobefit {
namespace {

using enum ClosureLayout::ShapeCurve;

// Cycles 4.2 takes anything with alpha_x alpha_y below 5e-7 for a mirror, and single precision
// loses the peak of a lobe much narrower than this.
const double least_log_alpha = std::log(0.002);

// The values of all curves at one view angle.
struct AtView {
  Eigen::VectorXd curves;
  double sine;
};

AtView at_view(const ClosureCurves& closures, double cosine) {
  const auto [first, share] = ViewSplines::at(cosine, closures.coefficients());
  return {closures.x.middleCols(first, share.size()) * share,
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

Microfacet microfacet(const ClosureCurves& closures, int closure, const Shape& shape,
                      const Vector3& wo) {
  return {closures.distributions[static_cast<std::size_t>(closure)], shape, wo};
}

std::vector<ClippedShape> clipped_shapes(const ClosureCurves& closures, const AtView& at,
                                         double cosine) {
  std::vector<ClippedShape> shapes;
  shapes.reserve(static_cast<std::size_t>(closures.layout.specular));
  for (int k = 0; k < closures.layout.specular; ++k) {
    shapes.push_back(clipped_shape(at, closures.layout, k, cosine));
  }
  return shapes;
}

ClosureKernelInput kernel_input(const ClosureCurves& closures, const SearchView& view,
                                const AtView& at, const std::vector<ClippedShape>& shapes,
                                double smoothing) {
  const ClosureLayout& layout = closures.layout;
  const auto column = [&](int which) { return view.lights.col(which).data(); };
  ClosureKernelInput input{};
  input.count = static_cast<std::size_t>(view.lights.rows());
  for (int c = 0; c < 3; ++c) {
    input.wi[c] = column(SearchView::wi_x + c);
    input.half[c] = column(SearchView::half_x + c);
    input.reflected[c] = column(SearchView::red + c);
    for (int k = 0; k < layout.closures(); ++k) {
      input.weights[k][c] = at.curves[layout.weight(k, c)];
    }
  }
  input.weight = column(SearchView::weight);
  input.typical = column(SearchView::typical);
  input.specular = layout.specular;
  for (int k = 0; k < layout.specular; ++k) {
    const Shape& shape = shapes[static_cast<std::size_t>(k)].shape;
    input.closures[k] = microfacet(closures, k, shape, view.wo).terms();
  }
  input.smoothing = smoothing;
  return input;
}

double view_error(const ClosureCurves& closures, const SearchView& view, double smoothing) {
  const AtView at = at_view(closures, view.wo.z());
  const std::vector<ClippedShape> shapes = clipped_shapes(closures, at, view.wo.z());
  return run_closure_error(kernel_input(closures, view, at, shapes, smoothing));
}

// How a closure's ln alpha_x, ln alpha_y and tilt follow its mean, spread and bend; 0 where they
// were clipped.
Eigen::Matrix3d shape_by_curves(const ClippedShape& shape, double sine) {
  Eigen::Matrix3d by = Eigen::Matrix3d::Zero();
  const double x = shape.x_free, y = shape.y_free;
  by.col(mean) << x, y, 0;
  by.col(spread) << -x * sine * sine, y * sine * sine, 0;
  by.col(bend) << 0, 0, shape.tilt_free * sine;
  return by;
}

// Gradient and reweighted least squares' matrix of view_error by the curves' values at the view.
struct ViewEquations {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd gradient;
};

ViewEquations linearise_view(const ClosureCurves& closures, const SearchView& view,
                             double smoothing) {
  const ClosureLayout& layout = closures.layout;
  const AtView at = at_view(closures, view.wo.z());
  const std::vector<ClippedShape> shapes = clipped_shapes(closures, at, view.wo.z());
  const ClosureKernelInput input = kernel_input(closures, view, at, shapes, smoothing);
  const ClosureKernelSums sums = run_closure_kernel(input);
  ViewEquations result{Eigen::MatrixXd::Zero(layout.curves(), layout.curves()),
                       Eigen::VectorXd::Zero(layout.curves())};
  using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  using Stride = Eigen::OuterStride<ClosureKernelSums::shapes>;
  const auto shape_of = [](std::ptrdiff_t closure) { return 3 * closure; };
  for (int k = 0; k < layout.specular; ++k) {
    const Eigen::Matrix3d by_k = shape_by_curves(shapes[static_cast<std::size_t>(k)], at.sine);
    const int row = layout.shape(k, 0);
    result.gradient.segment<3>(row) =
        by_k.transpose() * Eigen::Map<const Eigen::Vector3d>(sums.gradient_x + shape_of(k));
    for (int l = 0; l <= k; ++l) {
      const Eigen::Map<const RowMajor3, 0, Stride> part(&sums.matrix_xx[shape_of(k)][shape_of(l)]);
      Eigen::Matrix3d whole = part;
      if (k == l) whole = part.selfadjointView<Eigen::Lower>();
      const Eigen::Matrix3d by_l = shape_by_curves(shapes[static_cast<std::size_t>(l)], at.sine);
      result.matrix.block<3, 3>(row, layout.shape(l, 0)) = by_k.transpose() * whole * by_l;
    }
    for (int c = 0; c < 3; ++c) {
      for (int l = 0; l < layout.closures(); ++l) {
        const Eigen::Map<const Eigen::RowVector3d> part(&sums.matrix_vx[c][l][shape_of(k)]);
        result.matrix.block<1, 3>(layout.weight(l, c), row) = input.weights[k][c] * part * by_k;
      }
    }
  }
  for (int c = 0; c < 3; ++c) {
    for (int k = 0; k < layout.closures(); ++k) {
      result.gradient[layout.weight(k, c)] = sums.gradient_v[c][k];
      for (int l = 0; l <= k; ++l) {
        result.matrix(layout.weight(k, c), layout.weight(l, c)) = sums.matrix_vv[c][k][l];
      }
    }
  }
  result.matrix.triangularView<Eigen::StrictlyUpper>() = result.matrix.transpose();
  return result;
}

// A little curvature costs a little error, so that curves are smooth where the target does not say:
// the square of second differences of the coefficients. Weights are counted in their own size.
constexpr double stiffness = 1e-5;

// Splines of half the width have twice as many second differences for the same curve, each a
// quarter as large. They count twice as much, that curves may bend more once most is known of them.
double stiffness_of(int coefficients) {
  return stiffness * (coefficients - 3.0) / (ViewSplines::coarse - 3.0);
}

Eigen::MatrixXd second_differences(const Eigen::MatrixXd& x) {
  const Eigen::Index n = x.cols() - 2;
  return x.leftCols(n) - 2 * x.middleCols(1, n) + x.rightCols(n);
}

double stiffness_penalty(const ClosureCurves& closures) {
  const int n = closures.coefficients();
  return n < 3 ? 0 : stiffness_of(n) / 2 * second_differences(closures.x).squaredNorm();
}

// The unknowns stand coefficient after coefficient, so that each meets those of three coefficients
// after its own at most.
struct Equations {
  BandMatrix matrix;
  Eigen::VectorXd gradient;
};

void add_penalty(const ClosureCurves& closures, Equations& equations) {
  const Eigen::Index curves = closures.x.rows(), n = closures.x.cols();
  if (n < 3) return;
  const Eigen::Vector3d difference(1, -2, 1);
  const Eigen::Matrix3d both =
      stiffness_of(closures.coefficients()) * difference * difference.transpose();
  Eigen::Map<Eigen::MatrixXd> gradient(equations.gradient.data(), curves, n);
  for (Eigen::Index i = 0; i + 2 < n; ++i) {
    gradient.middleCols<3>(i) += closures.x.middleCols<3>(i) * both;
    for (Eigen::Index a = 0; a < 3; ++a) {
      for (Eigen::Index b = 0; b <= a; ++b) {
        for (Eigen::Index curve = 0; curve < curves; ++curve) {
          equations.matrix((i + a) * curves + curve, (i + b) * curves + curve) += both(a, b);
        }
      }
    }
  }
}

// Adds a view's equations to the coefficients of its splines.
void add_view(const ViewEquations& part, const ViewSplines::Support& support,
              Equations& equations) {
  const Eigen::Index curves = part.gradient.size();
  for (Eigen::Index b = 0; b < support.share.size(); ++b) {
    const Eigen::Index column = (support.first + b) * curves;
    equations.gradient.segment(column, curves) += support.share[b] * part.gradient;
    for (Eigen::Index a = b; a < support.share.size(); ++a) {
      const Eigen::Index row = (support.first + a) * curves;
      const double share = support.share[a] * support.share[b];
      for (Eigen::Index q = 0; q < curves; ++q) {
        for (Eigen::Index p = a == b ? q : 0; p < curves; ++p) {
          equations.matrix(row + p, column + q) += share * part.matrix(p, q);
        }
      }
    }
  }
}

Equations linearise(const SearchTarget& target, const ClosureCurves& closures, double smoothing) {
  const Eigen::Index curves = closures.x.rows();
  const int n = closures.coefficients();
  Equations sum{BandMatrix(closures.x.size(), std::min(n, 4) * curves - 1),
                Eigen::VectorXd::Zero(closures.x.size())};
  for (const SearchView& view : target) {
    add_view(linearise_view(closures, view, smoothing), ViewSplines::at(view.wo.z(), n), sum);
  }
  add_penalty(closures, sum);
  return sum;
}

struct Bounds {
  Eigen::VectorXd least, greatest;  // of each curve's coefficients
};

Bounds bounds_of(const ClosureLayout& layout) {
  Bounds bounds{Eigen::VectorXd::Zero(layout.curves()),
                Eigen::VectorXd::Constant(layout.curves(), 1e6)};
  for (int k = 0; k < layout.specular; ++k) {
    bounds.least.segment<3>(layout.shape(k, mean)) << least_log_alpha, -3, -3;
    bounds.greatest.segment<3>(layout.shape(k, mean)) << 0, 3, 3;
  }
  return bounds;
}

// A damped step within the bounds. An unknown at its bound stays there while the error falls
// outward.
Eigen::MatrixXd step_from(const Eigen::MatrixXd& x, const Bounds& bounds,
                          const Equations& equations, double damping) {
  const Eigen::Index curves = x.rows();
  std::vector<Eigen::Index> free;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const double at = x.data()[i];
    const bool held = equations.gradient[i] > 0 ? at <= bounds.least[i % curves]
                                                : at >= bounds.greatest[i % curves];
    if (!held && equations.matrix(i, i) > 0) free.push_back(i);
  }
  const auto count = static_cast<Eigen::Index>(free.size());
  Eigen::VectorXd scale(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Index at = free[static_cast<std::size_t>(i)];
    scale[i] = 1 / std::sqrt(equations.matrix(at, at));
  }
  const Eigen::Index band = equations.matrix.band();
  BandMatrix matrix(count, band);
  for (Eigen::Index j = 0; j < count; ++j) {
    const Eigen::Index column = free[static_cast<std::size_t>(j)];
    for (Eigen::Index i = j; i < count; ++i) {
      const Eigen::Index row = free[static_cast<std::size_t>(i)];
      if (row - column > band) break;
      matrix(i, j) = scale[i] * scale[j] * equations.matrix(row, column);
    }
    matrix(j, j) += damping;
  }
  const Eigen::VectorXd step = scale.cwiseProduct(
      matrix.solve_in_place(scale.cwiseProduct(equations.gradient(free).eval())));
  Eigen::MatrixXd tried = x;
  tried.reshaped()(free) -= step;
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    tried.col(i) = tried.col(i).cwiseMax(bounds.least).cwiseMin(bounds.greatest);
  }
  return tried;
}

}  // namespace

SearchView::SearchView(const TargetView& view) : wo(view.wo) {
  constexpr std::size_t at_once = closure_kernel_lanes;
  const std::size_t count = (view.lights.size() + at_once - 1) / at_once * at_once;
  lights.resize(static_cast<Eigen::Index>(count), columns);
  for (std::size_t i = 0; i < count; ++i) {
    const bool padding = i >= view.lights.size();
    const TargetLight& light = view.lights[padding ? 0 : i];
    lights.row(static_cast<Eigen::Index>(i)) << light.wi.transpose().array(),
        light.half.transpose().array(), light.reflected.transpose(), padding ? 0 : light.weight,
        light.typical;
  }
}

SearchTarget in_columns(const Target& target) { return {target.begin(), target.end()}; }

ClosureCurves subdivided(const ClosureCurves& closures) {
  ClosureCurves finer = closures;
  finer.x.resize(closures.x.rows(), 2 * closures.coefficients() - 3);
  for (Eigen::Index curve = 0; curve < closures.x.rows(); ++curve) {
    finer.x.row(curve) = ViewSplines::subdivided(closures.x.row(curve).transpose()).transpose();
  }
  return finer;
}

ClosureCurves constant_at(const ClosureCurves& closures, double cosine) {
  return {closures.layout, closures.distributions, at_view(closures, cosine).curves};
}

Shape shape_at(const ClosureCurves& closures, int closure, double cosine) {
  return clipped_shape(at_view(closures, cosine), closures.layout, closure, cosine).shape;
}

Eigen::VectorXd light_of_closures(const SearchView& view, const ClosureCurves& closures) {
  const ClosureLayout& layout = closures.layout;
  const AtView at = at_view(closures, view.wo.z());
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(layout.specular);
  for (int k = 0; k < layout.specular; ++k) {
    const Shape shape = clipped_shape(at, layout, k, view.wo.z()).shape;
    const Microfacet closure = microfacet(closures, k, shape, view.wo);
    for (Eigen::Index i = 0; i < view.lights.rows(); ++i) {
      const auto light = view.lights.row(i).matrix();
      sum[k] += light[SearchView::weight] *
                closure.evaluate(light.segment<3>(SearchView::wi_x).transpose(),
                                 light.segment<3>(SearchView::half_x).transpose());
    }
    sum[k] *= at.curves.segment<3>(layout.weight(k, 0)).sum();
  }
  return sum;
}

double smooth_error(const SearchTarget& target, const ClosureCurves& closures, double smoothing) {
  double sum = 0;
  for (const SearchView& view : target) sum += view_error(closures, view, smoothing);
  return sum + stiffness_penalty(closures);
}

ClosureCurves descend(const SearchTarget& target, ClosureCurves closures, double smoothing,
                      int iterations, const Monitor& monitor) {
  const Bounds bounds = bounds_of(closures.layout);
  double error = smooth_error(target, closures, smoothing), damping = 1e-3;
  ClosureCurves tried = closures;
  for (int iteration = 0; iteration < iterations; ++iteration) {
    monitor.throw_if_cancelled();
    const Equations equations = linearise(target, closures, smoothing);
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
