#include "closures/principled.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "closures/coat_table.h"
#include "closures/principled_terms.inc"

namespace lobefit {

PrincipledTerms principled_terms(const SharedSockets& sockets, double n_wo) {
  using S = PrincipledSlopes;
  const auto& [metallic, roughness, root, tint] = sockets;
  // Cycles takes anything narrower for a mirror; its lobe is black, whatever stands for its alpha.
  const bool mirror = square(square(roughness)) <= 2e-10;
  const double alpha2 = mirror ? 1 : square(square(roughness));
  PrincipledTerms t{};
  t.metallic = metallic;
  t.alpha2 = alpha2;
  t.scale = mirror ? 0 : 1 / (2 * pi * n_wo);
  const double spread = alpha2 * (1 - n_wo * n_wo) / (n_wo * n_wo);
  t.masking_o = std::sqrt(1 + spread);
  t.masking_o_by_log_roughness = 2 * spread / t.masking_o;
  t.dielectric = dielectric_terms(root);
  // At ior = 1 there is no coat, and the root of the root has no derivative.
  const double root_ior = std::sqrt(root);
  const CoatTable::Share coat =
      root > 0 ? CoatTable::instance()(roughness, n_wo, root_ior) : CoatTable::Share{};
  const double untinted = 1 - root * root * tint, uncoated = std::clamp(1 - coat.value, 0.0, 1.0);
  const double share = (1 - metallic) / pi;
  t.diffuse = share * untinted * uncoated;
  t.diffuse_by[S::metallic] = -untinted * uncoated / pi;
  t.diffuse_by[S::log_roughness] = -share * untinted * coat.by_roughness * roughness;
  t.diffuse_by[S::reflectance_root] = -share * 2 * root * tint * uncoated;
  if (root > 0) {
    t.diffuse_by[S::reflectance_root] -= share * untinted * coat.by_root_ior / (2 * root_ior);
  }
  t.diffuse_by[S::brightest_tint] = -share * root * root * uncoated;
  return t;
}

Rgb evaluate_principled(const Principled& principled, const Vector3& wi, const Vector3& wo) {
  if (!(wi.z() > 0 && wo.z() > 0)) return Rgb::Zero();
  const PrincipledTerms terms = principled_terms(
      {principled.metallic, principled.roughness, (principled.ior - 1) / (principled.ior + 1),
       principled.specular_tint.maxCoeff()},
      wo.z());
  const FacetLight<double> at = facet_light(wi, Vector3((wi + wo).normalized()));
  const PrincipledLight<double> light = principled_light<false>(terms, at);
  Rgb result;
  for (int c = 0; c < 3; ++c) {
    result[c] = principled_channel<false>(terms, at, light, principled.base_color[c],
                                          principled.specular_tint[c])
                    .value;
  }
  return result;
}

}  // namespace lobefit
