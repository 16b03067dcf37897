// How good the best-fit Principled BSDF is: ./dev bench principled_bench FILE..
//
// For each measurement the processor seconds that the fit takes, the error that it minimises,
// the sphere error (the mean over the angles 5, 10 .. 165 degrees between light and viewer of the
// relative L1 difference of pictures of a sphere), the most that 500 random perturbations of the
// sockets lower the first of the two, and the sockets.
#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <vector>

#include "../native/perturb_principled.h"
#include "closures/coat_table.h"
#include "closures/principled.h"
#include "measurement/input_error.h"
#include "measurement/read_measurement.h"

namespace {

using namespace lobefit;

// The relative L1 difference of two pictures of a sphere under one light at the angle `phase` to
// the view; pixels that see the sphere at a flat angle are left out.
double sphere_error(const Reflectance& reference, const Principled& principled, double phase) {
  constexpr int size = 96;
  constexpr double least_n_wo = 0.1, light_azimuth = 0.6;
  const Vector3 light(std::sin(phase) * std::cos(light_azimuth),
                      std::sin(phase) * std::sin(light_azimuth), std::cos(phase));
  double difference = 0, sum = 0;
  for (int row = 0; row < size; ++row) {
    for (int column = 0; column < size; ++column) {
      const double x = (column + 0.5) / size * 2 - 1, y = (row + 0.5) / size * 2 - 1;
      const double radius2 = x * x + y * y;
      if (1 - radius2 < least_n_wo * least_n_wo) continue;
      // The local frame whose x axis points toward the viewer.
      const double z = std::sqrt(1 - radius2), radius = std::sqrt(radius2);
      const Vector3 n(x, y, z);
      const Vector3 tangent = (Vector3::UnitZ() - z * n) / radius;
      const Vector3 wo(radius, 0, z);
      const Vector3 wi(light.dot(tangent), light.dot(n.cross(tangent)), light.dot(n));
      if (!(wi.z() > 0)) continue;
      const Rgb wanted = reference(wi, wo) * wi.z();
      if (!wanted.isFinite().all()) continue;
      difference += (evaluate_principled(principled, wi, wo) - wanted).abs().sum();
      sum += wanted.sum();
    }
  }
  return difference / sum;
}

double sphere_error(const Reflectance& reference, const Principled& principled) {
  constexpr int phases = 33;
  double sum = 0;
  for (int i = 1; i <= phases; ++i) sum += sphere_error(reference, principled, radians(5 * i));
  return sum / phases;
}

}  // namespace

int main(int count, char** arguments) {
  CoatTable::instance();  // What is made once a process is not counted.
  std::printf("%-24s %8s %9s %9s %8s   %s\n", "Principled BSDF", "seconds", "error", "sphere",
              "gain", "base color, metallic, roughness, ior, specular tint");
  for (int i = 1; i < count; ++i) {
    const std::filesystem::path file = arguments[i];
    try {
      const Measurement measurement = read_measurement(file);
      const Reflectance reflectance = [&](const Vector3& wi, const Vector3& wo) {
        return measurement.evaluate(wi, wo);
      };
      const Target target = sample_target(reflectance);
      const std::clock_t start = std::clock();
      const Principled fit = fit_principled(target, 1);
      const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
      std::printf(
          "%-24s %8.3f %9.4f %9.4f %7.3f%%   %.3f %.3f %.3f, %.3f, %.3f, %.3f, %.3f %.3f %.3f\n",
          file.stem().c_str(), seconds, fit.error, sphere_error(reflectance, fit),
          100 * gain_of_perturbations(target, fit, 500), fit.base_color[0], fit.base_color[1],
          fit.base_color[2], fit.metallic, fit.roughness, fit.ior, fit.specular_tint[0],
          fit.specular_tint[1], fit.specular_tint[2]);
      std::fflush(stdout);
    } catch (const InputError& error) {
      std::fprintf(stderr, "%s\n", error.what());
      return 2;
    }
  }
}
