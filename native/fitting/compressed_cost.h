// The whole objective as one Ceres cost.
#pragma once

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <vector>

#include "fitting/monitor.h"
#include "fitting/objective.h"

namespace lobefit {

// A block of n + 1 residuals for n free variables whose half squared norm, gradient and
// Gauss-Newton matrix are those of Objective: with H = R'R, g = J'Wr and F,
//
//   residuals = [R^-T g ; sqrt(F - |R^-T g|^2)],  Jacobian = [R ; 0].
//
// A Ceres LossFunction could not do this (it acts on the squared norm of a whole block), and a
// block a bin takes 75 times as long. The Jacobian is not the derivative of the residuals one by
// one; only J'r and J'J mean something.
//
// H is Newton's wherever a sum of squares can have it, which is close to the minimum: where it is
// positive definite and F >= |R^-T g|^2. Elsewhere it is that of reweighted squares, for which both
// hold always. Each asks for a pass of its own, so that after a point where Newton's fails it is
// not tried at the next 1, 2, 4, 8, 8.. points (NewtonPause).
//
// A step that leaves the bounds is cut where it first meets one; the solver is then to be stopped
// (left_bounds) and started again without the variable that met its bound. Ceres' own bounds are
// not used: they leave the other variables where a step over the bound would have had them.
class CompressedCost final : public ceres::CostFunction {
 public:
  // Moves the variables `free` of x; the others keep their values.
  CompressedCost(const Objective& objective, std::vector<int> free, Eigen::VectorXd x,
                 NewtonPause& pause, const Monitor& monitor);

  // False (which ends the solver) when the monitor was cancelled.
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

  // All variables at these values of the free ones, the last step cut at the bounds.
  Eigen::VectorXd within_bounds(const double* free_values) const;

  // Whether these values are cut.
  bool left_bounds(const double* free_values) const;

  // Of all points asked about that with the least value. Ceres does not take the step whose gain is
  // under its tolerance, though it knows what it leads to; a last step of Newton's gains digits.
  const Eigen::VectorXd& best() const { return best_; }

 private:
  struct Block {
    Eigen::VectorXd residuals;
    Eigen::MatrixXd jacobian;
  };
  // Nothing where the curvature is Newton's and no sum of squares can have it.
  std::optional<Block> compress(const double* free_values, Curvature curvature) const;

  // Newton's or the other, and the same whenever a point is asked about.
  Block compress(const double* free_values) const;

  const Objective& objective_;
  std::vector<int> free_;
  // Where the derivatives were last asked for: the point that the next step starts from.
  mutable Eigen::VectorXd x_;
  mutable Eigen::VectorXd best_;
  mutable double best_value_ = std::numeric_limits<double>::infinity();
  // The latest point and what its matrix was.
  mutable Eigen::VectorXd point_;
  mutable Curvature curvature_ = Curvature::newton;
  NewtonPause& pause_;
  const Monitor& monitor_;
};

}  // namespace lobefit
