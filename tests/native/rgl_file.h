// RGL files made for tests.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "measurement/vector3.h"

namespace lobefit {

struct TensorField {
  std::string name;
  std::uint8_t type;
  std::vector<std::uint64_t> shape;
  std::string bytes;
};
TensorField floats_field(const std::string& name, const std::vector<std::uint64_t>& shape,
                         const std::vector<float>& values);
TensorField bytes_field(const std::string& name, const std::string& values);
// The bytes of a tensor file of these fields, the values of each at a multiple of 8.
std::string tensor_file(const std::vector<TensorField>& fields);

// A surface to tabulate; directions are unit vectors in the frame n = +z. What is given of
// directions below the horizon, too, decides how good a table is near it.
struct Surface {
  std::function<double(const Vector3& m)> ndf = [](const Vector3&) { return 1.0; };
  std::function<double(const Vector3& wi)> sigma = [](const Vector3&) { return 0.25; };
  // In the coordinates of the unit square, up to a factor.
  std::function<double(const Vector3& wi, const Vector3& m)> vndf = [](auto&&...) { return 1.0; };
  // f cos(theta_o) / (ndf / (4 sigma)).
  std::function<Rgb(const Vector3& wi, const Vector3& wo)> scaled;
};
struct SurfaceGrid {
  // The azimuths of the light; one for an isotropic surface.
  std::vector<float> phi_i = {0};
  std::size_t elevations = 12;  // of the light, from the first to the last in degrees
  double first = 0, last = 90;  // spread evenly as the file's coordinate is
  std::size_t normals = 96;     // columns and rows of ndf, sigma and vndf
  std::size_t directions = 48;  // of the colours
};
// The fields of a file of this surface. With wavelengths each spectrum is the colour's red one at
// all of them.
std::vector<TensorField> rgl_fields(const Surface& surface, const SurfaceGrid& grid,
                                    const std::vector<float>& wavelengths = {});

// A surface that scatters equally everywhere: f = albedo / pi.
Surface matte_surface(const Rgb& albedo);
// Facets of a GGX distribution (Walter et al. 2007) that shadow and mask each other as their
// heights go together (Heitz 2014): mirrors that reflect all light, so that f is ggx_reflectance().
Surface ggx_surface(double roughness);
double ggx_reflectance(double roughness, const Vector3& wi, const Vector3& wo);

}  // namespace lobefit
