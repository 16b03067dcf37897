// The optimisation behind fit_closures: the curves of some closures as unknowns, all view angles at
// once, and the descent of their error.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "closures/closure_set.h"
#include "closures/target.h"
#include "fitting/monitor.h"

namespace lobefit {

// What closures may reflect at a view angle.
struct ViewLimits {
  double albedo;        // about what they reflect of a white world in their brightest channel
  Rgb most_albedo;      // what they may reflect of it in each channel
  bool excess = false;  // whether what it shows too much of them is limited by most_excess
};

// What a view angle alone decides.
struct ViewAngle {
  explicit ViewAngle(double cosine);

  double cosine, sine;
  double least_tilt, greatest_tilt;  // how far a closure may be bent
};

// A view of a target as the search reads it: its lights in columns, padded by lights of no weight
// to a multiple of what the kernel takes at once. What they reflect is by what is typical there,
// and their weight is that of a difference so large, their solid angle multiplied by it: so single
// precision has the range for any target.
struct SearchView {
  enum Column {
    wi_x,
    wi_y,
    wi_z,
    half_x,
    half_y,
    half_z,
    red,
    green,
    blue,
    weight,
    solid_angle,
    inverse_typical,
    columns
  };
  template <typename Scalar>
  using Lights = Eigen::Array<Scalar, Eigen::Dynamic, columns>;

  explicit SearchView(const TargetView& view);

  Vector3 wo;
  ViewAngle angle;
  Lights<double> lights;
  Lights<float> singles;  // the same in single precision
  double all_light;       // what the error counts when all is black
  // Where they are given, closures count as wrong for what is over them.
  std::optional<ViewLimits> limits = std::nullopt;
};

using SearchTarget = std::vector<SearchView>;
SearchTarget in_columns(const Target& target);

// Which curve is what. Each specular closure has three shape curves, then every closure, the
// diffuse one last, has a weight curve for each channel.
//   mean   m, (ln alpha_x + ln alpha_y) / 2
//   spread h, (ln alpha_y - ln alpha_x) / 2 = h sin^2 theta
//   bend   g, tan(tilt) = g sin theta
// so that a closure is isotropic and not bent at normal incidence whatever they are.
struct ClosureLayout {
  enum ShapeCurve { mean, spread, bend, shape_curves };

  int specular;
  int closures() const { return specular + 1; }
  int shape(int closure, int curve) const { return closure * shape_curves + curve; }
  int weight(int closure, int channel) const {
    return specular * shape_curves + closure * 3 + channel;
  }
  int curves() const { return specular * shape_curves + closures() * 3; }
};

// Closures on the way to their best curves: the distribution of each specular one, and the
// unknowns, the coefficients of ViewSplines: a row for each curve, a single column for constants.
struct ClosureCurves {
  ClosureLayout layout;
  std::vector<Distribution> distributions;
  Eigen::MatrixXd x;

  int coefficients() const { return static_cast<int>(x.cols()); }
  double at(int curve, double cosine) const {
    return ViewSplines::evaluate(x.row(curve).transpose(), cosine);
  }
};

// The same closures, their curves of the same course by splines of half the width.
ClosureCurves subdivided(const ClosureCurves& closures);

// The same closures with one specular closure more, all but black: so they can only become better.
// One set for each of both distributions and some widths; Beckmann closures come first.
std::vector<ClosureCurves> extended(const ClosureCurves& closures);

// The values of all curves at a view angle: the same closures there, with constant curves.
ClosureCurves constant_at(const ClosureCurves& closures, double cosine);

// A closure's shape at a view angle, within what Cycles can show.
Shape shape_at(const ClosureCurves& closures, int closure, double cosine);

// What each specular closure adds to the light of a view, in units of the error.
Eigen::VectorXd light_of_closures(const SearchView& view, const ClosureCurves& closures);

// What a white world shows too much of closures at a view angle, in each channel (world_excess.h),
// and which part of their albedo that may be: a hundredth, less what the integral and curve nodes
// are off. Views flatter than 80 degrees are a thirtieth of a sphere's picture; there it may be
// more and more.
Rgb world_excess(const ClosureCurves& closures, const Vector3& wo);
double most_excess(double cosine);

// The error, |r| rounded off below `smoothing` times what is typical there, plus a little for
// curvature, and much for what is over a view's limits.
double smooth_error(const SearchTarget& target, const ClosureCurves& closures, double smoothing);

// Levenberg and Marquardt's method on smooth_error, within the bounds of what Cycles can show; ends
// early where nothing is gained. Its threads share the views; how many there are changes nothing.
// Throws Cancelled.
ClosureCurves descend(const SearchTarget& target, ClosureCurves closures, double smoothing,
                      int iterations, const Monitor& monitor, int threads = 1);

}  // namespace lobefit
