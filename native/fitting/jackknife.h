// How well the data determine the parameters of a fit.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "fitting/monitor.h"
#include "fitting/options.h"
#include "fitting/samples.h"
#include "fitting/variables.h"

namespace lobefit {

// Intervals of about 95 % around the parameters of a fit, [low, high] in their own units.
// `undetermined` names the variables (Variables::names) whose interval says too little: exponent
// and index of refraction (its excess over 1) that stand at the end of their range or within no
// factor of 2; an interpolation within no half of its range; reflectances within no factor of 2,
// counted from a hundredth of the brightest channel on, so that a black channel is determined. A
// variable that moves nothing (the shape of a lobe without specular part) has its whole range.
struct Uncertainty {
  static constexpr double confidence = 0.95;
  Parameters low, high;
  Eigen::MatrixXd correlation;  // of the variables; 0 with one that does not vary, 1 with itself
  std::vector<std::string> undetermined;
  int blocks = 0;
  double seconds = 0;
};

// The block of each sample, from 0 to jackknife_blocks - 1: strips of theta_d with as many samples
// each, and every strip in patches of theta_h with as many samples each.
constexpr int jackknife_strips = 5, jackknife_blocks = jackknife_strips * jackknife_strips;
std::vector<int> jackknife_block_of(const Samples& samples);

// The delete-a-block jackknife (Quenouille 1956, Tukey 1958): the misfits of neighbouring bins go
// together, so that the millions of bins tell far less than their number says, and the inverse
// Hessian would find nearly no uncertainty. Blocks are wide patches, which hardly depend on each
// other. All variables are fitted again without each of them; x_b are the results and
//
//   covariance = (n - 1)/n sum (x_b - mean)(x_b - mean)'
//
// in the scale of the variables (log s, log(eta - 1), reflectances as they are, and the specular
// ones as the model's coefficients, whatever `variables` fit). The intervals are
// x -+ t sqrt(variance), where t = 2.064 is the two-sided 95 % quantile of Student's distribution
// of n - 1 = 24 degrees of freedom, since the variance comes from that few deviations. Errors that
// go together over more than half a block make them too narrow (the coverage of 95 % falls to some
// 75 %). `x` is the fit to all bins, `samples` a subsample of these. The same bits for any number
// of threads. Throws Cancelled.
Uncertainty jackknife(const Samples& samples, const Variables& variables, Norm norm,
                      const Eigen::VectorXd& x, int threads, const Monitor& monitor);

}  // namespace lobefit
