#include "rgl_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "measurement/density_warp.h"

namespace lobefit {
namespace {

constexpr std::uint8_t uint8_type = 1, float32_type = 10;

template <typename Value>
void append(std::string& bytes, Value value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

// From 0 to 1, both included.
double step(std::size_t i, std::size_t count) {
  return static_cast<double>(i) / static_cast<double>(count - 1);
}

Vector3 direction(double theta, double phi) {
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

double elevation_at(double x) { return x * x * (pi / 2); }
double azimuth_at(double y) { return (2 * y - 1) * pi; }

Vector3 mirrored(const Vector3& wi, const Vector3& m) { return 2 * wi.dot(m) * m - wi; }

// Where f(x) is `value`, for f that rises from 0 to 1.
double inverse(const std::function<double(double)>& f, double value) {
  double low = 0, high = 1;
  for (int i = 0; i < 40; ++i) {
    const double middle = (low + high) / 2;
    (f(middle) < value ? low : high) = middle;
  }
  return (low + high) / 2;
}

// Where the one table of the warp takes to (x, y).
std::array<double, 2> unflattened(const DensityWarp& warp, double x, double y) {
  const Mixture alone{{0, 0}, 0};
  const double row = inverse([&](double v) { return warp.flatten(0.5, v, alone)[1]; }, y);
  return {inverse([&](double u) { return warp.flatten(u, row, alone)[0]; }, x), row};
}

std::vector<float> on_grid(std::size_t size, const std::function<double(double, double)>& value) {
  std::vector<float> values;
  for (std::size_t row = 0; row < size; ++row) {
    for (std::size_t column = 0; column < size; ++column) {
      values.push_back(static_cast<float>(value(step(column, size), step(row, size))));
    }
  }
  return values;
}

void append(std::vector<float>& to, const std::vector<float>& values) {
  to.insert(to.end(), values.begin(), values.end());
}

double ggx_lambda(double roughness, const Vector3& w) {
  const double tangent = std::hypot(w.x(), w.y()) / w.z();
  return (std::sqrt(1 + square(roughness * tangent)) - 1) / 2;
}

double ggx_distribution(double roughness, const Vector3& m) {
  const double a2 = square(roughness);
  return a2 / (pi * square(square(m.z()) * (a2 - 1) + 1));
}

}  // namespace

TensorField floats_field(const std::string& name, const std::vector<std::uint64_t>& shape,
                         const std::vector<float>& values) {
  return {name, float32_type, shape,
          std::string(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float))};
}

TensorField bytes_field(const std::string& name, const std::string& values) {
  return {name, uint8_type, {values.size()}, values};
}

std::string tensor_file(const std::vector<TensorField>& fields) {
  std::size_t offset = 18;
  for (const TensorField& field : fields) {
    offset += 13 + field.name.size() + sizeof(std::uint64_t) * field.shape.size();
  }
  std::string head("tensor_file\0\1\0", 14), values;
  append(head, static_cast<std::uint32_t>(fields.size()));
  for (const TensorField& field : fields) {
    values.append((8 - (offset + values.size()) % 8) % 8, '\0');
    append(head, static_cast<std::uint16_t>(field.name.size()));
    head += field.name;
    append(head, static_cast<std::uint16_t>(field.shape.size()));
    append(head, field.type);
    append(head, static_cast<std::uint64_t>(offset + values.size()));
    for (const std::uint64_t n : field.shape) append(head, n);
    values += field.bytes;
  }
  return head + values;
}

std::vector<TensorField> rgl_fields(const Surface& surface, const SurfaceGrid& grid,
                                    const std::vector<float>& wavelengths) {
  const std::size_t n = grid.normals, channels = wavelengths.empty() ? 3 : wavelengths.size();
  const bool isotropic = grid.phi_i.size() == 1;
  const auto at = [](double x, double y) { return direction(elevation_at(x), azimuth_at(y)); };
  std::vector<float> theta_i, vndf, colours;
  for (std::size_t t = 0; t < grid.elevations; ++t) {
    const double first = std::sqrt(grid.first / 90), last = std::sqrt(grid.last / 90);
    const double x = std::lerp(first, last, step(t, grid.elevations));
    theta_i.push_back(static_cast<float>(elevation_at(x)));
  }
  for (const float phi : grid.phi_i) {
    for (const float theta : theta_i) {
      const Vector3 wi = direction(theta, isotropic ? 0 : phi);
      const std::vector<float> density =
          on_grid(n, [&](double x, double y) { return surface.vndf(wi, at(x, y)); });
      append(vndf, density);
      const DensityWarp warp(density, n, n);
      for (std::size_t c = 0; c < channels; ++c) {
        append(colours, on_grid(grid.directions, [&](double x, double y) {
                 const auto [u, v] = unflattened(warp, x, y);
                 const Rgb value = surface.scaled(wi, mirrored(wi, at(u, v)));
                 return value[wavelengths.empty() ? static_cast<Eigen::Index>(c) : 0];
               }));
      }
    }
  }
  const std::size_t p = grid.phi_i.size(), t = grid.elevations, d = grid.directions;
  std::vector<TensorField> fields = {
      bytes_field("description", "made for a test"),
      floats_field("phi_i", {p}, grid.phi_i),
      floats_field("theta_i", {t}, theta_i),
      floats_field("sigma", {n, n},
                   on_grid(n, [&](double x, double y) { return surface.sigma(at(x, y)); })),
      floats_field("ndf", {n, n},
                   on_grid(n, [&](double x, double y) { return surface.ndf(at(x, y)); })),
      floats_field("vndf", {p, t, n, n}, vndf),
      floats_field(wavelengths.empty() ? "rgb" : "spectra", {p, t, channels, d, d}, colours),
      bytes_field("jacobian", "\1"),
  };
  if (!wavelengths.empty()) {
    fields.push_back(floats_field("wavelengths", {wavelengths.size()}, wavelengths));
  }
  return fields;
}

Surface matte_surface(const Rgb& albedo) {
  Surface surface;
  surface.scaled = [=](const Vector3&, const Vector3& wo) { return Rgb(albedo / pi * wo.z()); };
  return surface;
}

Surface ggx_surface(double roughness) {
  Surface surface;
  surface.ndf = [=](const Vector3& m) { return ggx_distribution(roughness, m); };
  // The projected area of the facets that light from wi reaches.
  surface.sigma = [=](const Vector3& wi) { return wi.z() * (1 + ggx_lambda(roughness, wi)); };
  surface.vndf = [=](const Vector3& wi, const Vector3& m) {
    const double theta = std::atan2(std::hypot(m.x(), m.y()), m.z());
    // dm is sin(theta_m) dtheta_m dphi_m, and theta_m grows with the square of its coordinate.
    return ggx_distribution(roughness, m) * std::max(wi.dot(m), 0.0) * std::sin(theta) *
               std::sqrt(theta) +
           1e-4;
  };
  surface.scaled = [=](const Vector3& wi, const Vector3& wo) {
    const double above = 1 + ggx_lambda(roughness, wi);
    const Vector3 up(wo.x(), wo.y(), std::abs(wo.z()));
    const double seen = above / (above + ggx_lambda(roughness, up));
    return Rgb::Constant(wo.z() < 0 ? -seen : seen);
  };
  return surface;
}

double ggx_reflectance(double roughness, const Vector3& wi, const Vector3& wo) {
  const Vector3 m = (wi + wo).normalized();
  return ggx_distribution(roughness, m) / (4 * wi.z() * wo.z()) /
         (1 + ggx_lambda(roughness, wi) + ggx_lambda(roughness, wo));
}

}  // namespace lobefit
