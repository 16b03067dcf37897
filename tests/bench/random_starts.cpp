// How sure the fit is: ./dev bench random_starts FILE.. [STARTS]
//
// For each measurement, the default schedule and the paper's stages against the least L1 that
// random starts reach, each polished with all bins (interpolated model with Fresnel, 32 starts).
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "fitting/fit.h"
#include "fitting/minimise.h"
#include "fitting/samples.h"
#include "fitting/variables.h"
#include "measurement/input_error.h"
#include "measurement/read_measurement.h"

namespace {

using namespace lobefit;

double fitted_l1(const Measurement& measurement, Schedule schedule) {
  FitOptions options;
  options.schedule = schedule;
  Monitor monitor;
  return fit_model(measurement, options, monitor).errors.l1.pooled;
}

double random_l1(const Measurement& measurement, int starts) {
  const FitOptions options;
  const Samples all = all_samples(measurement, options);
  const Variables variables(options.kind, options.fresnel, false);
  const Monitor monitor;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  double least = std::numeric_limits<double>::infinity();
  for (int start = 0; start < starts; ++start) {
    Eigen::VectorXd x(9);
    for (int i = 0; i < 6; ++i) x[i] = std::exp(4 * uniform(random) - 2);
    x[6] = std::log(0.1) + uniform(random) * std::log(1e6);  // s from .1 to 1e5
    x[7] = uniform(random);
    x[8] = std::log(0.05) + uniform(random) * std::log(100.0);  // eta from 1.05 to 6
    for (const auto& free : {variables.reflectances(), variables.all()}) {
      x = minimise(all, variables, options.norm, free, x, fine_precision(), 2, monitor).x;
    }
    least = std::min(least,
                     error_figures(measurement, variables.to_parameters(x, all.unit), 2).l1.pooled);
  }
  return least;
}

}  // namespace

int main(int count, char** arguments) {
  int starts = 32;
  std::vector<std::filesystem::path> files;
  for (int i = 1; i < count; ++i) {
    if (const int number = std::atoi(arguments[i]); number > 0) {
      starts = number;
    } else {
      files.emplace_back(arguments[i]);
    }
  }
  std::printf("%-24s %12s %12s %12s\n", "least L1 of random starts", "L1", "default", "stages");
  for (const auto& file : files) {
    try {
      const Measurement measurement = read_measurement(file);
      const double least = random_l1(measurement, starts);
      std::printf("%-24s %12.6g %+11.3f%% %+11.3f%%\n", file.stem().c_str(), least,
                  100 * (fitted_l1(measurement, Schedule::polish) / least - 1),
                  100 * (fitted_l1(measurement, Schedule::stages) / least - 1));
      std::fflush(stdout);
    } catch (const InputError& error) {
      std::fprintf(stderr, "%s\n", error.what());
      return 2;
    }
  }
}
