// How sure the fit is: ./dev bench random_starts FILE.. [STARTS]
//
// For each measurement, the default schedule and the paper's stages against the least L1 that
// random starts reach (interpolated model with Fresnel, 32 starts), each polished on a subsample as
// the best starts of a fit are and then with all bins; and how many of them end within .1 % of
// that.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
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

// Of every start, the least first.
std::vector<double> random_l1(const Measurement& measurement, int starts) {
  const FitOptions options;
  const Samples all = all_samples(measurement, options);
  const Samples some = subsample(all, 16000, 2);
  const Variables variables(options.kind, options.fresnel, false, Specular::peak);
  const Monitor monitor;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<double> reached;
  for (int start = 0; start < starts; ++start) {
    Eigen::VectorXd x(9);
    for (int i = 0; i < 6; ++i) x[i] = std::exp(4 * uniform(random) - 2);
    x[6] = std::log(0.1) + uniform(random) * std::log(1e6);  // s from .1 to 1e5
    x[7] = uniform(random);
    x[8] = std::log(0.05) + uniform(random) * std::log(100.0);  // eta from 1.05 to 6
    for (const auto& free : {variables.reflectances(), variables.all()}) {
      x = minimise(some, variables, options.norm, free, x, finishing_precision(), 2, monitor).x;
    }
    x = minimise(all, variables, options.norm, variables.all(), x, last_precision(), 2, monitor).x;
    reached.push_back(
        error_figures(measurement, variables.to_parameters(x, all.unit), 2).l1.pooled);
  }
  std::sort(reached.begin(), reached.end());
  return reached;
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
  std::printf("%-24s %12s %8s %12s %12s\n", "random starts", "least L1", "near it", "default",
              "stages");
  for (const auto& file : files) {
    try {
      const Measurement measurement = read_measurement(file);
      const std::vector<double> reached = random_l1(measurement, starts);
      const double least = reached.front();
      const auto near = std::count_if(reached.begin(), reached.end(),
                                      [&](double l1) { return l1 <= 1.001 * least; });
      std::printf("%-24s %12.6g %8d %+11.3f%% %+11.3f%%\n", file.stem().c_str(), least,
                  static_cast<int>(near),
                  100 * (fitted_l1(measurement, Schedule::polish) / least - 1),
                  100 * (fitted_l1(measurement, Schedule::stages) / least - 1));
      std::fflush(stdout);
    } catch (const InputError& error) {
      std::fprintf(stderr, "%s\n", error.what());
      return 2;
    }
  }
}
