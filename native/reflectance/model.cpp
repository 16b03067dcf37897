#include "reflectance/model.h"

#include <cmath>
#include <string>

#include "measurement/input_error.h"
#include "reflectance/fresnel.h"

namespace lobefit {

std::string_view name_of(ModelKind kind) {
  switch (kind) {
    case ModelKind::modified_phong:
      return "modified-phong";
    case ModelKind::modified_blinn_phong:
      return "modified-blinn-phong";
    case ModelKind::interpolated:
      break;
  }
  return "interpolated";
}

ModelKind model_named(std::string_view name) {
  for (const ModelKind kind :
       {ModelKind::modified_phong, ModelKind::modified_blinn_phong, ModelKind::interpolated}) {
    if (name == name_of(kind)) return kind;
  }
  throw InputError("model: expected modified-phong, modified-blinn-phong or interpolated, found '" +
                   std::string(name) + "'.");
}

double specular_scale(ModelKind kind, double exponent) {
  switch (kind) {
    case ModelKind::modified_phong:
      return (exponent + 2) / (2 * pi);
    case ModelKind::modified_blinn_phong:
      return (exponent + 8) / (8 * pi);
    case ModelKind::interpolated:
      break;
  }
  return 1;
}

Parameters as_interpolated(const Parameters& parameters) {
  Parameters result = parameters;
  result.kind = ModelKind::interpolated;
  for (int c = 0; c < 3; ++c) {
    result.specular[c] *= specular_scale(parameters.kind, parameters.exponent[c]);
  }
  if (parameters.kind == ModelKind::modified_phong) result.interpolation = 0;
  if (parameters.kind == ModelKind::modified_blinn_phong) {
    result.interpolation = 1;
    result.exponent /= 4;
  }
  return result;
}

LobeCoordinates lobe_coordinates(const HalfDifference& point) {
  return lobe_coordinates(std::sin(point.theta_h), std::cos(point.theta_h), std::cos(point.theta_d),
                          std::sin(point.theta_d) * std::cos(point.phi_d));
}

double lobe_power(const LobeCoordinates& at, double interpolation, double exponent) {
  const double u = (1 - interpolation) * at.u_phong + interpolation * at.u_blinn;
  return u < 1 ? std::exp(exponent * std::log1p(-u)) : 0;
}

Rgb evaluate_model(const Parameters& parameters, const HalfDifference& point) {
  const Parameters lobe = as_interpolated(parameters);
  const LobeCoordinates at = lobe_coordinates(point);
  const double fresnel = lobe.ior ? fresnel_reflectance(at.cos_theta_d, *lobe.ior).value : 1;
  Rgb power;
  for (int c = 0; c < 3; ++c) power[c] = lobe_power(at, lobe.interpolation, lobe.exponent[c]);
  return lobe.diffuse / pi + lobe.specular * power * fresnel;
}

Rgb evaluate_model(const Parameters& parameters, const Vector3& wi, const Vector3& wo) {
  if (!(wi.z() > 0 && wo.z() > 0)) return Rgb::Zero();
  return evaluate_model(parameters, to_half_difference(wi, wo));
}

}  // namespace lobefit
