// The optimisation behind fit_closures: the curves of some closures as unknowns, all view angles at
// once, and the descent of their error.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "closures/closure_set.h"
#include "closures/target.h"
#include "fitting/monitor.h"

namespace lobefit {

// Where the unknowns are: coefficients of ViewSplines, curve after curve. Each specular closure has
// three shape curves, then every closure, the diffuse one last, has a weight curve for each
// channel.
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
  int unknowns() const { return curves() * ViewSplines::count; }
};

struct ClosureProblem {
  const Target* target;
  ClosureLayout layout;
  std::vector<Distribution> distributions;
};

// A closure's shape at a view angle, within what Cycles can show.
Shape shape_at(const ClosureLayout& layout, const Eigen::VectorXd& x, int closure, double cosine);

// The error of unknowns x over every stride-th view, |r| rounded off below `smoothing` times what
// is typical there, plus a little for curvature.
double smooth_error(const ClosureProblem& problem, int stride, const Eigen::VectorXd& x,
                    double smoothing);

// Levenberg and Marquardt's method on smooth_error, within the bounds of what Cycles can show; ends
// early where nothing is gained. Throws Cancelled.
Eigen::VectorXd descend(const ClosureProblem& problem, int stride, Eigen::VectorXd x,
                        double smoothing, int iterations, const Monitor& monitor);

}  // namespace lobefit
