// Measurements of the RGL material database (Dupuy and Jakob 2018, "An adaptive parameterization
// for efficient material acquisition and rendering", TOG 37(6)).
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "measurement/density_warp.h"
#include "measurement/input_file.h"
#include "measurement/measurement.h"
#include "measurement/tensor_file.h"
#include "measurement/vector3.h"

namespace lobefit {

// What an RGL file tells, at any pair of directions. An angle is a coordinate of the unit square by
// u(theta) = sqrt(2 theta / pi) and u(phi) = (phi + pi) / (2 pi). For light from wi and a viewer at
// wo, with m half way between them,
//
//   f cos(theta_o) = S(T(u(theta_m), u(phi_m))) D(m) / (4 sigma(wi)),
//
// where D is the tabulated distribution of normals (`ndf`), sigma the area that the surface shows
// to the light, T the map that spreads the tabulated visible normals (`vndf`) evenly and S the
// table `rgb` or `spectra`. Tables are bilinear between their points; those of vndf and S are there
// for several wi and linear between them. In an isotropic file phi_m counts from the azimuth of the
// light, in an anisotropic one as it is. Spectra become linear Rec.709 by rgb_weights().
class Rgl {
 public:
  // Throws InputError for a file that is cut off, or whose fields are missing, of another type or
  // shape, or hold what they cannot. The file is not needed later.
  explicit Rgl(const InputFile& file);

  bool isotropic() const { return isotropic_; }

  // f cos(theta_o) in 1/sr for unit vectors in the local frame (n = +z); of an anisotropic file the
  // mean over all turns of both about the normal. Colours beyond the gamut of Rec.709 have negative
  // channels. NaN below the horizon and for light beyond the elevations that were measured.
  Rgb evaluate(const Vector3& wi, const Vector3& wo) const;

  // f in 1/sr. What the file tells of light and viewer and of the two interchanged differs by the
  // errors of the measurement. f is the mean of the two, each weighing as its cosine: near the
  // horizon a table that does not fall to zero as the cosine does must not be divided by it alone.
  // Negative channels are zero. NaN where evaluate() tells neither.
  Rgb reflectance(const Vector3& wi, const Vector3& wo) const;

 private:
  // One grid after another, each of columns x rows points.
  struct Grids {
    std::size_t columns, rows;
    std::vector<float> values;

    const float* grid(std::size_t i) const { return values.data() + i * columns * rows; }
  };
  // An azimuth of the light that was measured (radians), and what it weighs in the mean over all.
  // Its tables are the first-th and following, one for each elevation of the light; where they
  // count azimuths from, the half vector's is origin + sign * (phi_m - phi_i).
  struct Azimuth {
    std::size_t first;
    double light, origin, sign, weight;
  };
  // A half vector: u(theta_m) and phi_m.
  struct Half {
    double x, phi;
  };
  // Light and half vector: u(theta_i), u(theta_m) and phi_m - phi_i.
  struct Angles {
    double x_i, x_m, turn;
  };

  explicit Rgl(const TensorFile& file);

  static std::vector<Azimuth> read_azimuths(const TensorFile& file, std::size_t elevations);
  static Grids read_grid(const TensorFile& file, const std::string& name);
  // Of as many azimuths and elevations of the light as `tables` says.
  static DensityWarp read_visible_normals(const TensorFile& file, const TensorFile::Shape& tables);
  static Grids read_colours(const TensorFile& file, const TensorFile::Shape& tables);

  static Half half_between(const Vector3& wi, const Vector3& wo);
  Mixture elevations_around(double theta_i) const;
  Rgb evaluate(const Vector3& wi, const Half& half) const;
  Rgb evaluate(const Azimuth& azimuth, const Mixture& elevations, const Angles& angles) const;

  std::vector<float> theta_i_;
  bool isotropic_;
  std::vector<Azimuth> azimuths_;
  Grids normals_, area_;
  DensityWarp visible_normals_;
  Grids colours_;  // red, green and blue of a table, then those of the next
  bool scaled_;    // whether S is to be multiplied by D / (4 sigma)
};

// The table of Rgl::reflectance, with a warning where the file is anisotropic. threads: at most so
// many, 0 for every processor. Throws InputError.
Measurement read_rgl(const InputFile& file, int threads = 0);

}  // namespace lobefit
