// Fits at the end of what a table can hold: ./dev bench extremes
//
// For each of extreme_tables() in tests/native/tables.h: the relative L1 over all bins of the fit
// and of the truth (where there is one), the largest relative error of a parameter, whether it
// converged, iterations, seconds, the ratio of the extreme eigenvalues of the column-scaled Newton
// matrix where the fit ended (inf: not positive definite), and the warnings.
#include <Eigen/Eigenvalues>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>

#include "../native/tables.h"
#include "fitting/fit.h"
#include "fitting/objective.h"
#include "measurement/input_error.h"

namespace {

using namespace lobefit;

// The largest relative error of rho_d, k_s, s and eta - 1, and the error of alpha.
double parameter_error(const Parameters& truth, const Parameters& found) {
  const auto relative = [](double known, double other) {
    return known != 0 ? std::abs(other / known - 1) : std::abs(other);
  };
  double worst = std::abs(found.interpolation - truth.interpolation);
  for (int c = 0; c < 3; ++c) {
    worst = std::max({worst, relative(truth.diffuse[c], found.diffuse[c]),
                      relative(truth.specular[c], found.specular[c]),
                      relative(truth.exponent[c], found.exponent[c])});
  }
  return truth.ior ? std::max(worst, relative(*truth.ior - 1, *found.ior - 1)) : worst;
}

double conditioning(const Measurement& measurement, const Parameters& parameters) {
  const FitOptions options;
  const Samples samples = all_samples(measurement, options);
  const Variables variables(options.kind, options.fresnel, options.separate_channels);
  const Objective objective(samples, variables, options.norm, 0.01, 2);
  const Eigen::VectorXd x = variables.from_parameters(parameters, samples.unit);
  const Eigen::MatrixXd matrix = objective.evaluate(x, Curvature::newton).hessian;
  const Eigen::VectorXd scale = matrix.diagonal().cwiseAbs().cwiseSqrt().cwiseInverse();
  if (!scale.allFinite()) return std::numeric_limits<double>::infinity();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * matrix * scale.asDiagonal();
  const Eigen::VectorXd values =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(scaled).eigenvalues();
  return values.minCoeff() > 0 ? values.maxCoeff() / values.minCoeff()
                               : std::numeric_limits<double>::infinity();
}

void print_row(const ExtremeTable& table) {
  const Measurement measurement = table.make();
  const auto start = std::chrono::steady_clock::now();
  Monitor monitor;
  const Fit fit = fit_model(measurement, {}, monitor);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  int iterations = 0;
  for (const Stage& stage : fit.stages) iterations += stage.iterations;
  std::string of_truth = "-", off = "-";
  if (table.truth) {
    char text[32];
    std::snprintf(text, sizeof text, "%.2e",
                  error_figures(measurement, *table.truth, 2).relative_l1.pooled);
    of_truth = text;
    std::snprintf(text, sizeof text, "%.1e", parameter_error(*table.truth, fit.parameters));
    off = text;
  }
  std::printf("%-30s %9.2e %9s %8s %4s %6d %7.2f %8.1e", table.name.c_str(),
              fit.errors.relative_l1.pooled, of_truth.c_str(), off.c_str(),
              fit.converged ? "yes" : "no", iterations, seconds.count(),
              conditioning(measurement, fit.parameters));
  // The first words of a warning tell which it is.
  for (const std::string& warning : fit.warnings) std::printf("  [%.34s..]", warning.c_str());
  std::printf("\n");
  std::fflush(stdout);
}

}  // namespace

int main() {
  std::printf("%-30s %9s %9s %8s %4s %6s %7s %8s  %s\n", "table", "rel. L1", "truth's", "off",
              "end", "iter.", "seconds", "cond.", "warnings");
  for (const ExtremeTable& table : extreme_tables()) print_row(table);
  try {
    Monitor monitor;
    fit_model(no_valid_bin(), {}, monitor);
    std::printf("%-30s fitted\n", "no valid bin");
  } catch (const InputError& error) {
    std::printf("%-30s %s\n", "no valid bin", error.what());
  }
}
