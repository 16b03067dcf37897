#include "preview/two_lights.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "measurement/parallel.h"
#include "reflectance/albedo.h"

namespace lobefit {
namespace {

const std::array<Vector3, 2> lights = {Vector3(1, 1, 1.2).normalized(),
                                       Vector3(-1, -1, -0.55).normalized()};

// The radiance toward +z of a point of the sphere, whose normal is its position, by the two lights.
Rgb lit(const Reflectance& f_times_cosine, const Vector3& normal) {
  Eigen::Matrix3d to_local;
  const Vector3 tangent = normal.unitOrthogonal();
  to_local << tangent.transpose(), normal.cross(tangent).transpose(), normal.transpose();
  const Vector3 wo = to_local * Vector3::UnitZ();
  Rgb radiance = Rgb::Zero();
  for (const Vector3& light : lights) {
    const Vector3 wi = to_local * light;
    if (!(wi.z() > 0)) continue;
    const Rgb reflected = f_times_cosine(wi, wo);
    if (!reflected.isNaN().any()) radiance += reflected;
  }
  return radiance;
}

// What a world of radiance 1 adds, by the cosine of the view angle.
class AlbedoByCosine {
 public:
  explicit AlbedoByCosine(const Reflectance& f_times_cosine) {
    const Reflectance f = [&](const Vector3& wi, const Vector3& wo) -> Rgb {
      return f_times_cosine(wi, wo) / wi.z();
    };
    parallel_for(steps + 1, thread_count(0), [&](int step) {
      albedo_[static_cast<std::size_t>(step)] = directional_albedo(f, std::acos(cosine(step)));
    });
  }

  Rgb operator()(double view_cosine) const {
    const double place = std::sqrt(std::clamp(view_cosine, 0.0, 1.0)) * steps;
    const auto step = std::min(static_cast<std::size_t>(place), std::size_t{steps - 1});
    const double share = place - static_cast<double>(step);
    return (1 - share) * albedo_[step] + share * albedo_[step + 1];
  }

 private:
  static constexpr int steps = 48;

  // Steps are dense toward grazing angles, where the albedo of polished surfaces rises steeply; the
  // horizon itself, from where nothing is seen, is left out.
  static double cosine(int step) {
    const double root = std::max(step, 1) / static_cast<double>(steps);
    return root * root;
  }

  std::array<Rgb, steps + 1> albedo_;
};

using Shade = std::function<Rgb(const Vector3& normal)>;

void render_row(const Shade& shade, int size, int row, float* pixels) {
  const auto centre = [size](int index) { return (2 * index + 1.0) / size - 1; };
  const double y = -centre(row);
  for (int column = 0; column < size; ++column) {
    const double x = centre(column), z2 = 1 - x * x - y * y;
    if (z2 <= 0) continue;
    const Rgb radiance = shade(Vector3(x, y, std::sqrt(z2)));
    Eigen::Map<Eigen::Array3f>(pixels + 3 * column) = radiance.cast<float>();
  }
}

}  // namespace

std::vector<float> render_two_lights(const Reflectance& f_times_cosine, int size, double world) {
  const auto row_floats = static_cast<std::size_t>(size) * 3;
  std::vector<float> picture(row_floats * static_cast<std::size_t>(size), 0.0f);
  Shade shade = [&](const Vector3& normal) { return lit(f_times_cosine, normal); };
  if (world > 0) {
    const AlbedoByCosine albedo(f_times_cosine);
    shade = [&f_times_cosine, world, albedo](const Vector3& normal) -> Rgb {
      return lit(f_times_cosine, normal) + world * albedo(normal.z());
    };
  }
  parallel_for(size, thread_count(0), [&](int row) {
    render_row(shade, size, row, picture.data() + static_cast<std::size_t>(row) * row_floats);
  });
  return picture;
}

}  // namespace lobefit
