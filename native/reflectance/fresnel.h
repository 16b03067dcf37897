// The Fresnel reflectance of a dielectric.
#pragma once

namespace lobefit {

// A value and its derivatives by the index of refraction.
struct FresnelReflectance {
  double value;
  double derivative;
  double second_derivative;
};

// R_F for unpolarised light that arrives from outside at an angle of the given cosine (0..1) on a
// dielectric of index of refraction ior >= 1 (Cook and Torrance 1982, eq. for k = 0). Exact to
// rounding also where ior - 1 is tiny: R_F is then the square of small, directly formed numbers.
FresnelReflectance fresnel_reflectance(double cosine, double ior);

}  // namespace lobefit
