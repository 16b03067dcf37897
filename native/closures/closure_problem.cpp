#include "closures/closure_problem.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "closures/band_matrix.h"
#include "closures/closure_kernel.h"
#include "closures/world_excess.h"
#include "measurement/parallel.h"

namespace lobefit {
namespace {

using enum ClosureLayout::ShapeCurve;

// Cycles 4.2 takes anything with alpha_x alpha_y below 5e-7 for a mirror, and single precision
// loses the peak of a lobe much narrower than this.
const double least_log_alpha = std::log(0.002);

// Sums and equations of a view need no memory from the system.
constexpr int most_curves = 3 * most_specular_closures + 3 * (most_specular_closures + 1);
using CurveVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, most_curves, 1>;
using CurveMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, most_curves, most_curves>;

// Cycles bends a normal back whose mirror direction of the viewer is not clear of the horizon: its
// height has to be .01, or .9 of the viewer's own.
double least_tilt_at(double cosine) {
  const double least_height = std::min(0.9 * cosine, 0.0105);
  return -std::tan((std::asin(cosine) - std::asin(least_height)) / 2);
}

// A shape within what Cycles can show, and which of its numbers were clipped.
struct ClippedShape {
  Shape shape;
  bool x_free, y_free, tilt_free;
};

// The values of all curves at one view angle, and the shapes that they stand for.
struct AtView {
  CurveVector curves;
  std::array<ClippedShape, most_specular_closures> shapes;
};

ClippedShape clipped_shape(const CurveVector& curves, const ClosureLayout& layout, int closure,
                           const ViewAngle& angle) {
  const double m = curves[layout.shape(closure, mean)];
  const double h = curves[layout.shape(closure, spread)] * angle.sine * angle.sine;
  const double t = curves[layout.shape(closure, bend)] * angle.sine;
  const auto clip = [](double value, double low, double high, bool& free) {
    free = value > low && value < high;
    return std::clamp(value, low, high);
  };
  ClippedShape result;
  result.shape.log_alpha_x = clip(m - h, least_log_alpha, 0, result.x_free);
  result.shape.log_alpha_y = clip(m + h, least_log_alpha, 0, result.y_free);
  result.shape.tilt = clip(t, angle.least_tilt, angle.greatest_tilt, result.tilt_free);
  return result;
}

AtView at_view(const ClosureCurves& closures, const ViewAngle& angle) {
  const auto [first, share] = ViewSplines::at(angle.cosine, closures.coefficients());
  AtView at{closures.x.middleCols(first, share.size()).lazyProduct(share), {}};
  for (int k = 0; k < closures.layout.specular; ++k) {
    at.shapes[static_cast<std::size_t>(k)] = clipped_shape(at.curves, closures.layout, k, angle);
  }
  return at;
}

Microfacet microfacet(const ClosureCurves& closures, const AtView& at, int closure,
                      const Vector3& wo) {
  const auto k = static_cast<std::size_t>(closure);
  return {closures.distributions[k], at.shapes[k].shape, wo};
}

template <typename Scalar>
ClosureKernelInput<Scalar> kernel_input(const ClosureCurves& closures, const AtView& at,
                                        const Vector3& wo, const SearchView::Lights<Scalar>& lights,
                                        double smoothing) {
  const ClosureLayout& layout = closures.layout;
  const auto column = [&](int which) { return lights.col(which).data(); };
  ClosureKernelInput<Scalar> input{};
  input.count = static_cast<std::size_t>(lights.rows());
  for (int c = 0; c < 3; ++c) {
    input.wi[c] = column(SearchView::wi_x + c);
    input.half[c] = column(SearchView::half_x + c);
    input.reflected[c] = column(SearchView::red + c);
    for (int k = 0; k < layout.closures(); ++k) {
      input.weights[k][c] = static_cast<Scalar>(at.curves[layout.weight(k, c)]);
    }
  }
  input.weight = column(SearchView::weight);
  input.inverse_typical = column(SearchView::inverse_typical);
  input.specular = layout.specular;
  for (int k = 0; k < layout.specular; ++k) {
    input.closures[k] = microfacet(closures, at, k, wo).terms().as<Scalar>();
  }
  input.smoothing = static_cast<Scalar>(smoothing);
  return input;
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

// Gradient and reweighted least squares' matrix of the error at a view by the curves' values there;
// of the matrix the lower half.
struct ViewEquations {
  CurveMatrix matrix;
  CurveVector gradient;
};

std::vector<Microfacet> microfacets(const ClosureCurves& closures, const AtView& at,
                                    const Vector3& wo) {
  std::vector<Microfacet> all;
  for (int k = 0; k < closures.layout.specular; ++k) all.push_back(microfacet(closures, at, k, wo));
  return all;
}

// The weights of all closures at a view, in columns.
auto weights_of(const ClosureLayout& layout, const AtView& at) {
  return at.curves.tail(3 * layout.closures()).reshaped(3, layout.closures());
}

// What the closures of a view are over a limit, as a part of their albedo, in each channel; and its
// derivatives by the curves' values.
using OverLimit = Eigen::Vector3d;
using OverByCurves = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, most_curves>;

// So large that closures which gain by it are over most_excess by a few per cent of it.
constexpr double excess_weight = 200;

// So large that grey closures which gain all their light by it are over most_albedo by a thirtieth.
// Lowering their weights by the rest costs less than to keep the limit at any price.
double albedo_weight(const SearchView& view) { return 10 * view.all_light; }

OverLimit over_excess(const SearchView& view, const WorldExcess& excess) {
  return (excess.albedo / view.limits->albedo - most_excess(view.angle.cosine)).cwiseMax(0);
}

OverByCurves excess_by_curves(const ClosureCurves& closures, const SearchView& view,
                              const AtView& at, std::vector<Microfacet> seen,
                              const WorldExcess& excess) {
  const ClosureLayout& layout = closures.layout;
  OverByCurves by_curves(3, layout.curves());
  by_curves.rightCols(3 * layout.closures()) = excess.by_weights;
  for (int k = 0; k < layout.specular; ++k) {
    constexpr double step = 1e-5;
    const auto index = static_cast<std::size_t>(k);
    const Microfacet here = seen[index];
    Eigen::Matrix3d by_shape;
    int i = 0;
    for (const auto parameter : {&Shape::log_alpha_x, &Shape::log_alpha_y, &Shape::tilt}) {
      Shape moved = at.shapes[index].shape;
      moved.*parameter += step;
      seen[index] = Microfacet(closures.distributions[index], moved, view.wo);
      by_shape.col(i++) =
          (world_excess<false>(seen, weights_of(layout, at)).albedo - excess.albedo) / step;
    }
    seen[index] = here;
    by_curves.middleCols<3>(layout.shape(k, 0)) =
        by_shape * shape_by_curves(at.shapes[index], view.angle.sine);
  }
  return by_curves / view.limits->albedo;
}

// What each closure reflects of a white world per weight.
ClosureKernelLight white_light(const ClosureCurves& closures, const SearchView& view,
                               const AtView& at) {
  auto input = kernel_input(closures, at, view.wo, view.singles, 0);
  input.weight = view.singles.col(SearchView::solid_angle).data();
  return run_closure_light(input);
}

OverLimit over_albedo(const ClosureLayout& layout, const SearchView& view, const AtView& at,
                      const ClosureKernelLight& light) {
  const Eigen::Map<const Eigen::VectorXd> per_weight(light.v, layout.closures());
  const Eigen::Vector3d albedo = weights_of(layout, at) * per_weight;
  return ((albedo.array() - view.limits->most_albedo) / view.limits->albedo).cwiseMax(0);
}

OverByCurves albedo_by_curves(const ClosureLayout& layout, const SearchView& view, const AtView& at,
                              const ClosureKernelLight& light) {
  OverByCurves by_curves(3, layout.curves());
  for (int k = 0; k < layout.closures(); ++k) {
    by_curves.middleCols<3>(layout.weight(k, 0)) = light.v[k] * Eigen::Matrix3d::Identity();
    if (k == layout.specular) break;
    by_curves.middleCols<3>(layout.shape(k, 0)) =
        weights_of(layout, at).col(k) *
        Eigen::Map<const Eigen::RowVector3d>(light.by_shape + 3 * k) *
        shape_by_curves(at.shapes[static_cast<std::size_t>(k)], view.angle.sine);
  }
  return by_curves / view.limits->albedo;
}

double limits_penalty(const ClosureCurves& closures, const SearchView& view, const AtView& at) {
  if (!view.limits) return 0;
  const ClosureLayout& layout = closures.layout;
  const double penalty =
      albedo_weight(view) / 2 *
      over_albedo(layout, view, at, white_light(closures, view, at)).squaredNorm();
  if (!view.limits->excess) return penalty;
  const WorldExcess excess =
      world_excess<false>(microfacets(closures, at, view.wo), weights_of(layout, at));
  return penalty + excess_weight / 2 * over_excess(view, excess).squaredNorm();
}

// Adds the equations of what is over a limit; channels that are not over it count for nothing.
template <typename ByCurves>
void add_over(double weight, const OverLimit& over, ByCurves&& by_curves,
              ViewEquations& equations) {
  if (over.isZero(0)) return;
  OverByCurves by = by_curves();
  for (int c = 0; c < 3; ++c) {
    if (over[c] == 0) by.row(c).setZero();
  }
  equations.gradient += weight * by.transpose() * over;
  equations.matrix += weight * by.transpose() * by;
}

// Adds the equations of limits_penalty by the curves' values.
void add_limits(const ClosureCurves& closures, const SearchView& view, const AtView& at,
                ViewEquations& equations) {
  if (!view.limits) return;
  const ClosureLayout& layout = closures.layout;
  const ClosureKernelLight light = white_light(closures, view, at);
  add_over(
      albedo_weight(view), over_albedo(layout, view, at, light),
      [&] { return albedo_by_curves(layout, view, at, light); }, equations);
  if (!view.limits->excess) return;
  const std::vector<Microfacet> seen = microfacets(closures, at, view.wo);
  const WorldExcess excess = world_excess<true>(seen, weights_of(layout, at));
  add_over(
      excess_weight, over_excess(view, excess),
      [&] { return excess_by_curves(closures, view, at, seen, excess); }, equations);
}

ViewEquations linearise_view(const ClosureCurves& closures, const SearchView& view,
                             double smoothing) {
  const ClosureLayout& layout = closures.layout;
  const AtView at = at_view(closures, view.angle);
  const auto input = kernel_input(closures, at, view.wo, view.singles, smoothing);
  const ClosureKernelSums sums = run_closure_kernel(input);
  ViewEquations result{CurveMatrix::Zero(layout.curves(), layout.curves()),
                       CurveVector::Zero(layout.curves())};
  std::array<Eigen::Matrix3d, most_specular_closures> by;
  for (std::size_t k = 0; k < by.size(); ++k) {
    by[k] = shape_by_curves(at.shapes[k], view.angle.sine);
  }
  using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  using Stride = Eigen::OuterStride<ClosureKernelSums::shapes>;
  const auto shape_of = [](std::ptrdiff_t closure) { return 3 * closure; };
  for (int k = 0; k < layout.specular; ++k) {
    const Eigen::Matrix3d& by_k = by[static_cast<std::size_t>(k)];
    const int row = layout.shape(k, 0);
    result.gradient.segment<3>(row) =
        by_k.transpose() * Eigen::Map<const Eigen::Vector3d>(sums.gradient_x + shape_of(k));
    for (int l = 0; l <= k; ++l) {
      const Eigen::Map<const RowMajor3, 0, Stride> part(&sums.matrix_xx[shape_of(k)][shape_of(l)]);
      Eigen::Matrix3d whole = part;
      if (k == l) whole = part.selfadjointView<Eigen::Lower>();
      result.matrix.block<3, 3>(row, layout.shape(l, 0)) =
          by_k.transpose() * whole * by[static_cast<std::size_t>(l)];
    }
    for (int c = 0; c < 3; ++c) {
      for (int l = 0; l < layout.closures(); ++l) {
        const Eigen::Map<const Eigen::RowVector3d> part(&sums.matrix_vx[c][l][shape_of(k)]);
        result.matrix.block<1, 3>(layout.weight(l, c), row) =
            at.curves[layout.weight(k, c)] * part * by_k;
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
  add_limits(closures, view, at, result);
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

// The error of a target's lights, in double or single precision, and the penalty.
template <typename Scalar>
double error_in(const SearchTarget& target, SearchView::Lights<Scalar> SearchView::*lights,
                const ClosureCurves& closures, double smoothing, int threads) {
  std::vector<double> of_views(target.size());
  parallel_for(static_cast<int>(target.size()), threads, [&](int i) {
    const auto index = static_cast<std::size_t>(i);
    const SearchView& view = target[index];
    const AtView at = at_view(closures, view.angle);
    of_views[index] =
        run_closure_error(kernel_input(closures, at, view.wo, view.*lights, smoothing)) +
        limits_penalty(closures, view, at);
  });
  return std::accumulate(of_views.begin(), of_views.end(), stiffness_penalty(closures));
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

// Views next to each other have the same splines. Their equations are added up first, once for
// each pair of these, the lower half of each matrix in one column: so the large matrix is reached
// once for all of them.
class SplineSums {
 public:
  SplineSums(Eigen::Index curves, Equations& equations) : curves_(curves), equations_(equations) {}

  void add(const ViewEquations& part, const ViewSplines::Support& support) {
    if (support.first != first_) begin(support);
    Packed packed(matrices_.rows());
    for (Eigen::Index q = 0, to = 0; q < curves_; to += curves_ - q++) {
      packed.segment(to, curves_ - q) = part.matrix.col(q).tail(curves_ - q);
    }
    for (Eigen::Index b = 0, pair = 0; b < support.share.size(); ++b) {
      gradients_.col(b) += support.share[b] * part.gradient;
      for (Eigen::Index a = b; a < support.share.size(); ++a) {
        matrices_.col(pair++) += support.share[a] * support.share[b] * packed;
      }
    }
  }

  // Hands the sums over.
  void end() {
    for (Eigen::Index b = 0, pair = 0; b < gradients_.cols(); ++b) {
      const Eigen::Index column = (first_ + b) * curves_;
      equations_.gradient.segment(column, curves_) += gradients_.col(b);
      for (Eigen::Index a = b; a < gradients_.cols(); ++a, ++pair) {
        for (Eigen::Index q = 0, from = 0; q < curves_; from += curves_ - q++) {
          const auto part = matrices_.col(pair).segment(from, curves_ - q);
          const Eigen::Index row = (first_ + a) * curves_ + q;
          equations_.matrix.below(row, column + q, curves_ - q) += part;
          if (a == b) continue;
          for (Eigen::Index p = 1; p < curves_ - q; ++p) {
            equations_.matrix(row, column + q + p) += part[p];
          }
        }
      }
    }
  }

 private:
  static constexpr int most_packed = most_curves * (most_curves + 1) / 2;
  using Packed = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, most_packed, 1>;

  void begin(const ViewSplines::Support& support) {
    end();
    first_ = support.first;
    const Eigen::Index splines = support.share.size();
    gradients_.setZero(curves_, splines);
    matrices_.setZero(curves_ * (curves_ + 1) / 2, splines * (splines + 1) / 2);
  }

  const Eigen::Index curves_;
  Equations& equations_;
  Eigen::Index first_ = -1;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, most_curves, 4> gradients_;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, most_packed, 10> matrices_;
};

void linearise(const SearchTarget& target, const ClosureCurves& closures, double smoothing,
               int threads, Equations& equations) {
  const Eigen::Index curves = closures.x.rows();
  const int n = closures.coefficients();
  equations.matrix.reset(closures.x.size(), std::min(n, 4) * curves - 1);
  equations.gradient.setZero(closures.x.size());
  // Made by all threads and then added up in order, so many at a time that they stay in the cache.
  std::array<ViewEquations, 16> of_views;
  SplineSums sums(curves, equations);
  for (std::size_t first = 0; first < target.size(); first += of_views.size()) {
    const std::size_t count = std::min(of_views.size(), target.size() - first);
    parallel_for(static_cast<int>(count), threads, [&](int i) {
      const auto index = static_cast<std::size_t>(i);
      of_views[index] = linearise_view(closures, target[first + index], smoothing);
    });
    for (std::size_t i = 0; i < count; ++i) {
      sums.add(of_views[i], ViewSplines::at(target[first + i].angle.cosine, n));
    }
  }
  sums.end();
  add_penalty(closures, equations);
}

// The closures with one more at a place among the specular ones.
ClosureCurves with_closure(const ClosureCurves& closures, int place, Distribution distribution,
                           double alpha) {
  constexpr double faint = 1e-3;
  const ClosureLayout &from = closures.layout, to{from.specular + 1};
  ClosureCurves more{to, closures.distributions,
                     Eigen::MatrixXd::Zero(to.curves(), closures.coefficients())};
  more.distributions.insert(more.distributions.begin() + place, distribution);
  for (int k = 0; k < from.closures(); ++k) {
    const int moved = k < place ? k : k + 1;
    const auto copy = [&](int row, int of_row) {
      more.x.middleRows<3>(row) = closures.x.middleRows<3>(of_row);
    };
    copy(to.weight(moved, 0), from.weight(k, 0));
    if (k < from.specular) copy(to.shape(moved, 0), from.shape(k, 0));
  }
  more.x.row(to.shape(place, mean)).setConstant(std::log(alpha));
  more.x.middleRows<3>(to.weight(place, 0)).setConstant(faint);
  return more;
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

// A damped step within the bounds, with a matrix to work in. An unknown at its bound stays there
// while the error falls outward.
Eigen::MatrixXd step_from(const Eigen::MatrixXd& x, const Bounds& bounds,
                          const Equations& equations, double damping, BandMatrix& matrix) {
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
  matrix.reset(count, band);
  for (Eigen::Index j = 0, end = 0; j < count; ++j) {
    const Eigen::Index column = free[static_cast<std::size_t>(j)];
    while (end < count && free[static_cast<std::size_t>(end)] - column <= band) ++end;
    const Eigen::Index* rows = free.data() + j;
    const auto from = equations.matrix.below(column, column, band + 1);
    auto to = matrix.below(j, j, end - j);
    for (Eigen::Index i = 0; i < end - j; ++i) {
      to[i] = scale[j + i] * scale[j] * from[rows[i] - column];
    }
    to[0] += damping;
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

ViewAngle::ViewAngle(double of_cosine)
    : cosine(of_cosine),
      sine(std::sqrt(std::max(0.0, 1 - cosine * cosine))),
      least_tilt(least_tilt_at(cosine)),
      // No bend reaches the viewer itself.
      greatest_tilt(0.8 * sine / cosine) {}

SearchView::SearchView(const TargetView& view) : wo(view.wo), angle(wo.z()) {
  constexpr std::size_t at_once = closure_kernel_lanes;
  // What is so many times brighter than its surroundings is a fault of the target.
  constexpr double brightest = 1e15;
  const std::size_t count = (view.lights.size() + at_once - 1) / at_once * at_once;
  lights.resize(static_cast<Eigen::Index>(count), columns);
  for (std::size_t i = 0; i < count; ++i) {
    const bool padding = i >= view.lights.size();
    const TargetLight& light = view.lights[padding ? 0 : i];
    const Rgb reflected = light.reflected / light.typical;
    lights.row(static_cast<Eigen::Index>(i)) << light.wi.transpose().array(),
        light.half.transpose().array(), reflected.cwiseMin(brightest).transpose(),
        padding ? 0 : light.weight * light.typical, padding ? 0 : light.solid_angle * light.typical,
        1 / light.typical;
  }
  all_light = (lights.col(weight) * lights.middleCols<3>(red).rowwise().sum()).sum();
  singles = lights.cast<float>();
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

std::vector<ClosureCurves> extended(const ClosureCurves& closures) {
  std::vector<ClosureCurves> all;
  for (const double alpha : {0.008, 0.025, 0.07, 0.17, 0.4, 0.9}) {
    all.push_back(with_closure(closures, 0, Distribution::beckmann, alpha));
    all.push_back(with_closure(closures, closures.layout.specular, Distribution::ggx, alpha));
  }
  return all;
}

ClosureCurves constant_at(const ClosureCurves& closures, double cosine) {
  return {closures.layout, closures.distributions, at_view(closures, ViewAngle(cosine)).curves};
}

Shape shape_at(const ClosureCurves& closures, int closure, double cosine) {
  return at_view(closures, ViewAngle(cosine)).shapes[static_cast<std::size_t>(closure)].shape;
}

Eigen::VectorXd light_of_closures(const SearchView& view, const ClosureCurves& closures) {
  const ClosureLayout& layout = closures.layout;
  const AtView at = at_view(closures, view.angle);
  const auto light = run_closure_light(kernel_input(closures, at, view.wo, view.singles, 0));
  Eigen::VectorXd sum(layout.specular);
  for (int k = 0; k < layout.specular; ++k) {
    sum[k] = light.v[k] * weights_of(layout, at).col(k).sum();
  }
  return sum;
}

Rgb world_excess(const ClosureCurves& closures, const Vector3& wo) {
  const AtView at = at_view(closures, ViewAngle(wo.z()));
  return world_excess<false>(microfacets(closures, at, wo), weights_of(closures.layout, at)).albedo;
}

double most_excess(double cosine) {
  constexpr double most = 0.0088, flat_cosine = 0.16;
  return most * std::max(1.0, square(flat_cosine / cosine));
}

double smooth_error(const SearchTarget& target, const ClosureCurves& closures, double smoothing) {
  return error_in(target, &SearchView::lights, closures, smoothing, 1);
}

ClosureCurves descend(const SearchTarget& target, ClosureCurves closures, double smoothing,
                      int iterations, const Monitor& monitor, int threads) {
  const Bounds bounds = bounds_of(closures.layout);
  const auto error_of = [&](const ClosureCurves& of) {
    return error_in(target, &SearchView::singles, of, smoothing, threads);
  };
  double error = error_of(closures), damping = 1e-3;
  ClosureCurves tried = closures;
  Equations equations;
  BandMatrix matrix;
  for (int iteration = 0; iteration < iterations; ++iteration) {
    monitor.throw_if_cancelled();
    linearise(target, closures, smoothing, threads, equations);
    const double before = error;
    for (int attempt = 0; attempt < 6 && !(error < before); ++attempt) {
      tried.x = step_from(closures.x, bounds, equations, damping, matrix);
      const double tried_error = error_of(tried);
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
