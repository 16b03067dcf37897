// The search for closures: ./dev bench closure_bench FILE..
//
// For each measured file, for the lobe that is fitted to it, and for 1, 2 and 3 specular closures:
// error, least seconds of three searches on every processor beside the seconds of sampling, and the
// number of points of all curves. The last columns are bounds for 2 and 3: the sum of the errors of
// closures that are fitted to each view angle alone, without smooth curves between them. No
// material made of a diffuse and so many such closures can be much nearer than that.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <string>

#include "closures/fit_closures.h"
#include "fitting/fit.h"
#include "measurement/read_measurement.h"

namespace lobefit {
namespace {

template <typename Work>
double seconds_of(Work&& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

std::size_t points_of(const ClosureSet& closures) {
  std::size_t points = 0;
  const auto add = [&](const ViewCurve& curve) { points += curve.points().size(); };
  for (const ViewCurve& curve : closures.diffuse) add(curve);
  for (const SpecularClosure& specular : closures.specular) {
    add(specular.roughness);
    add(specular.anisotropy);
    add(specular.bend);
    for (const ViewCurve& curve : specular.weight) add(curve);
  }
  return points;
}

double bound(const Target& target, int specular) {
  double sum = 0;
  Monitor monitor;
  const ClosureFitOptions options{specular, false, 0};
  for (const TargetView& view : target) sum += fit_closures({view}, options, monitor).error;
  return sum;
}

void tell(const std::string& name, const Reflectance& f) {
  Target target;
  const double sample = seconds_of([&] { target = sample_target(f); });
  std::printf("| %s | %.3f |", name.c_str(), sample);
  for (int count = 1; count <= most_specular_closures; ++count) {
    FittedClosures fitted;
    double least = 1e9;
    for (int round = 0; round < 3; ++round) {
      Monitor monitor;
      const ClosureFitOptions options{count, false, 0};
      least = std::min(least, seconds_of([&] { fitted = fit_closures(target, options, monitor); }));
    }
    std::printf(" %.4f, %.2f s, %zu |", fitted.error, least, points_of(fitted.closures));
  }
  std::printf(" %.4f | %.4f |\n", bound(target, 2), bound(target, 3));
  std::fflush(stdout);
}

void tell(const std::string& path) {
  const Measurement measurement = read_measurement(path);
  tell(path, [&](const Vector3& wi, const Vector3& wo) { return measurement.evaluate(wi, wo); });
  FitOptions options;
  options.norm = Norm::cosine_l1;
  Monitor monitor;
  const Parameters lobe = fit_model(measurement, options, monitor).parameters;
  tell(path + ", its lobe",
       [&](const Vector3& wi, const Vector3& wo) { return evaluate_model(lobe, wi, wo); });
}

}  // namespace
}  // namespace lobefit

int main(int count, char** paths) {
  std::printf("| target | sample s | 1: error, s, points | 2 | 3 | bound of 2 | of 3 |\n");
  std::printf("|---|---|---|---|---|---|---|\n");
  for (int i = 1; i < count; ++i) lobefit::tell(paths[i]);
}
