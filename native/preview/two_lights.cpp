#include "preview/two_lights.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <future>
#include <thread>

namespace lobefit {
namespace {

const std::array<Vector3, 2> lights = {Vector3(1, 1, 1.2).normalized(),
                                       Vector3(-1, -1, -0.55).normalized()};

// The radiance toward +z of a point of the sphere, whose normal is its position.
Rgb shade(const Reflectance& f_times_cosine, const Vector3& normal) {
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

void render_row(const Reflectance& f_times_cosine, int size, int row, float* pixels) {
  const auto centre = [size](int index) { return (2 * index + 1.0) / size - 1; };
  const double y = -centre(row);
  for (int column = 0; column < size; ++column) {
    const double x = centre(column), z2 = 1 - x * x - y * y;
    if (z2 <= 0) continue;
    const Rgb radiance = shade(f_times_cosine, Vector3(x, y, std::sqrt(z2)));
    Eigen::Map<Eigen::Array3f>(pixels + 3 * column) = radiance.cast<float>();
  }
}

}  // namespace

std::vector<float> render_two_lights(const Reflectance& f_times_cosine, int size) {
  const auto row_floats = static_cast<std::size_t>(size) * 3;
  std::vector<float> picture(row_floats * static_cast<std::size_t>(size), 0.0f);
  const int threads = static_cast<int>(std::max(2u, std::thread::hardware_concurrency()));
  std::vector<std::future<void>> workers;
  // Rows are dealt out in turn, because those across the middle hold more of the sphere.
  for (int first = 0; first < threads; ++first) {
    workers.push_back(std::async(std::launch::async, [&, first] {
      for (int row = first; row < size; row += threads) {
        render_row(f_times_cosine, size, row,
                   picture.data() + static_cast<std::size_t>(row) * row_floats);
      }
    }));
  }
  for (auto& worker : workers) worker.get();
  return picture;
}

}  // namespace lobefit
