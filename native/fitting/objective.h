// The misfit of a model to samples, with its gradient and the matrix of reweighted squares.
#pragma once

#include <Eigen/Core>
#include <array>

#include "fitting/samples.h"
#include "fitting/variables.h"

namespace lobefit {

// F = sum over samples, channels and both halves of weight * rho(r), r = model - measured, with
//   rho(r) = 2 e^2 (sqrt(1 + r^2/e^2) - 1)   of the norms l1 and cosine_l1: about 2 e |r|,
//   rho(r) = r^2                             of l2 and log_l2.
// Its matrix is J'WJ with W = rho'(r) / (2 r), that of reweighted squares, which never overshoots
// and converges slowly; or half of F's second derivatives, Newton's, which is fast close to the
// minimum and need not be positive definite farther off. For log_l2 both are Gauss and Newton's.
enum class Curvature { reweighted, newton };

// At how many points Newton's matrix was not to be tried after it had failed, and at how many more
// it is not. A fit that goes on from another on more samples meets the same objective.
struct NewtonPause {
  int length = 0, left = 0;

  // What the next point is asked about with.
  Curvature next() const { return left > 0 ? Curvature::reweighted : Curvature::newton; }
};

struct Evaluation {
  double value = 0;          // F
  double true_value = 0;     // sum of weight |r| (without smoothing), or F for the square norms
  Eigen::VectorXd gradient;  // J'Wr = dF/dx / 2, W = rho'(r) / (2 r)
  Eigen::MatrixXd hessian;   // of the curvature asked for
};

class Objective {
 public:
  Objective(const Samples& samples, const Variables& variables, Norm norm, double smoothing,
            int threads)
      : samples_(samples),
        variables_(variables),
        norm_(norm),
        smoothing_(smoothing),
        threads_(threads) {}

  // One pass over the samples, or none where the same was asked a moment ago; x within its bounds.
  // The same bits for any number of threads, because each run is summed by itself and the runs in
  // their order. The answer is good until the next question. Not to be asked by two threads.
  const Evaluation& evaluate(const Eigen::VectorXd& x,
                             Curvature curvature = Curvature::reweighted) const;

  // The same for those who need no matrix: that of the answer is of the curvature at hand, or of
  // the one that is `wanted` next.
  const Evaluation& evaluate_slope(const Eigen::VectorXd& x, Curvature wanted) const;

  const Variables& variables() const { return variables_; }
  double smoothing() const { return smoothing_; }
  // How many passes were made.
  int passes() const { return passes_; }

 private:
  Evaluation pass(const Eigen::VectorXd& x, Curvature curvature) const;

  const Samples& samples_;
  const Variables& variables_;
  Norm norm_;
  double smoothing_;
  int threads_;
  // A solver comes back to the point it stood at after a step that led nowhere; either point may
  // have been asked about with both curvatures.
  struct Answer {
    Eigen::VectorXd x;
    Curvature curvature{};
    Evaluation evaluation;

    bool is_at(const Eigen::VectorXd& point) const {
      return x.size() == point.size() && x == point;
    }
  };
  mutable std::array<Answer, 4> answers_;  // the latest first
  mutable int passes_ = 0;
};

}  // namespace lobefit
