#include "preview/two_lights.h"

#include <array>
#include <cmath>
#include <functional>

#include "measurement/parallel.h"
#include "reflectance/albedo.h"
#include "reflectance/seen_point.h"

namespace lobefit {
namespace {

const std::array<Vector3, 2> lights = {Vector3(1, 1, 1.2).normalized(),
                                       Vector3(-1, -1, -0.55).normalized()};

// The radiance toward +z of a point of the sphere, whose normal is its position, by the two lights.
Rgb lit(const Reflectance& f_times_cosine, const Vector3& normal) {
  const SeenPoint point(normal);
  Rgb radiance = Rgb::Zero();
  for (const Vector3& light : lights) radiance += point.lit(f_times_cosine, light);
  return radiance;
}

using Shade = std::function<Rgb(const Vector3& normal)>;

void render_row(const Shade& shade, int size, int row, float* pixels) {
  const auto centre = [size](int index) { return (2 * index + 1.0) / size - 1; };
  const double y = -centre(row);
  for (int column = 0; column < size; ++column, pixels += 3) {
    const double x = centre(column), z2 = 1 - x * x - y * y;
    if (z2 <= 0) continue;
    const Rgb radiance = shade(Vector3(x, y, std::sqrt(z2)));
    Eigen::Array3f::Map(pixels) = radiance.cast<float>();
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
