#include "fitting/compressed_cost.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

namespace lobefit {

using Eigen::MatrixXd;
using Eigen::VectorXd;

CompressedCost::CompressedCost(const Objective& objective, std::vector<int> free, VectorXd x,
                               NewtonPause& pause, const Monitor& monitor)
    : objective_(objective),
      free_(std::move(free)),
      x_(std::move(x)),
      best_(x_),
      pause_(pause),
      monitor_(monitor) {
  set_num_residuals(static_cast<int>(free_.size()) + 1);
  mutable_parameter_block_sizes()->push_back(static_cast<int>(free_.size()));
}

VectorXd CompressedCost::within_bounds(const double* free_values) const {
  const VectorXd& lower = objective_.variables().lower();
  const VectorXd& upper = objective_.variables().upper();
  VectorXd step = VectorXd::Zero(x_.size());
  double share = 1;
  int met = -1;
  for (std::size_t i = 0; i < free_.size(); ++i) {
    const int v = free_[i];
    step[v] = free_values[i] - x_[v];
    const double room = (step[v] < 0 ? lower[v] : upper[v]) - x_[v];
    if (room == 0) {
      step[v] = 0;  // at its bound already, and staying there
    } else if (room / step[v] < share) {
      share = room / step[v];
      met = v;
    }
  }
  VectorXd x = objective_.variables().clamp(x_ + share * step);
  // To the last bit, so that the variable is known to stand at its bound.
  if (met >= 0) x[met] = step[met] < 0 ? lower[met] : upper[met];
  return x;
}

bool CompressedCost::left_bounds(const double* free_values) const {
  return within_bounds(free_values)(free_) !=
         Eigen::Map<const VectorXd>(free_values, static_cast<Eigen::Index>(free_.size()));
}

std::optional<CompressedCost::Block> CompressedCost::compress(const double* free_values,
                                                              Curvature curvature) const {
  const auto n = static_cast<Eigen::Index>(free_.size());
  const VectorXd x = within_bounds(free_values);
  const Evaluation at = objective_.evaluate(x, curvature);
  if (at.value < best_value_) {
    best_ = x;
    best_value_ = at.value;
  }
  const VectorXd gradient = at.gradient(free_);
  const MatrixXd hessian = at.hessian(free_, free_);
  // Columns are scaled to a unit diagonal, because k_s and log s differ by many orders; a variable
  // without effect (the shape of a lobe of k_s = 0) gets a diagonal of its own.
  const VectorXd diagonal = hessian.diagonal();
  const VectorXd scale = (diagonal.array() > 0).select(diagonal.array().sqrt(), 1.0);
  MatrixXd scaled = scale.cwiseInverse().asDiagonal() * hessian * scale.cwiseInverse().asDiagonal();
  scaled.diagonal().array() += 1e-12;
  const Eigen::LLT<MatrixXd, Eigen::Upper> factor(scaled);
  if (factor.info() != Eigen::Success && curvature == Curvature::newton) return {};
  const MatrixXd root = factor.matrixU();
  const VectorXd projected =
      root.transpose().triangularView<Eigen::Lower>().solve(gradient.cwiseQuotient(scale));
  const double rest = at.value - projected.squaredNorm();
  if (!(rest >= 0) && curvature == Curvature::newton) return {};
  Block block{VectorXd(n + 1), MatrixXd::Zero(n + 1, n)};
  block.jacobian.topRows(n) = root * scale.asDiagonal();
  block.residuals << projected, std::sqrt(std::max(0.0, rest));
  return block;
}

CompressedCost::Block CompressedCost::compress(const double* free_values) const {
  const Eigen::Map<const VectorXd> point(free_values, static_cast<Eigen::Index>(free_.size()));
  const bool known = point_.size() == point.size() && point_ == point;
  if (!known) {
    point_ = point;
    curvature_ = pause_.next();
    pause_.left = std::max(0, pause_.left - 1);
  }
  if (curvature_ == Curvature::newton) {
    if (const auto block = compress(free_values, Curvature::newton)) {
      pause_.length = 0;
      return *block;
    }
    curvature_ = Curvature::reweighted;
    pause_.left = pause_.length = std::clamp(2 * pause_.length, 1, 8);
  }
  return *compress(free_values, Curvature::reweighted);
}

bool CompressedCost::Evaluate(double const* const* parameters, double* residuals,
                              double** jacobians) const {
  if (monitor_.cancelled()) return false;
  const auto n = static_cast<Eigen::Index>(free_.size());
  // Ceres asks for value and derivatives of one point in two calls; the objective remembers it.
  const Block block = compress(parameters[0]);
  Eigen::Map<VectorXd>(residuals, n + 1) = block.residuals;
  if (jacobians != nullptr && jacobians[0] != nullptr) {
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    Eigen::Map<RowMajor>(jacobians[0], n + 1, n) = block.jacobian;
    if (!left_bounds(parameters[0])) x_(free_) = Eigen::Map<const VectorXd>(parameters[0], n);
  }
  return true;
}

}  // namespace lobefit
