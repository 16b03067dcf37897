#include "closures/principled.h"

#include <Eigen/Geometry>

#include "closures/principled_terms.h"

namespace lobefit {
namespace {

// Visits wi.wh over the visible normals of a GGX surface seen under n.wo that reflect upward, by
// stretched spherical caps (Dupuy and Benyoub 2023) at the points of a Fibonacci lattice of equal
// weights; returns the number of all its points.
template <typename Visitor>
int visit_visible_normals(double roughness, double n_wo, Visitor&& visit) {
  constexpr int points = 987, stride = 610;
  const double alpha = roughness * roughness;
  const Vector3 wo(std::sqrt(1 - n_wo * n_wo), 0, n_wo);
  const Vector3 stretched = Vector3(alpha * wo.x(), 0, wo.z()).normalized();
  for (int point = 0; point < points; ++point) {
    // The normals are symmetric about the plane of wo, so half a turn is enough.
    const double phi = pi * (point * stride % points + 0.5) / points;
    const double z = 1 - (point + 0.5) / points * (1 + stretched.z());
    const double radius = std::sqrt(std::max(0.0, 1 - z * z));
    const Vector3 sum = Vector3(radius * std::cos(phi), radius * std::sin(phi), z) + stretched;
    const Vector3 wh = Vector3(alpha * sum.x(), alpha * sum.y(), sum.z()).normalized();
    const double wo_h = wo.dot(wh);
    if (2 * wo_h * wh.z() > wo.z()) visit(wo_h);
  }
  return points;
}

}  // namespace

CoatTable::CoatTable() {
  std::array<double, nodes> positions, roots;
  for (std::size_t i = 0; i < nodes; ++i) {
    positions[i] = std::max(double(i) / (nodes - 1), 1e-4);
    roots[i] = square(std::min(positions[i], 0.99));
  }
  auto* value = values_.data();
  for (const double roughness : positions) {
    for (const double n_wo : positions) {
      std::array<double, nodes> sums{};
      const int points = visit_visible_normals(roughness, n_wo, [&](double cosine) {
        for (std::size_t i = 0; i < nodes; ++i) sums[i] += schlick_weight(roots[i], cosine);
      });
      for (const double sum : sums) *value++ = static_cast<float>(sum / points);
    }
  }
}

const CoatTable& CoatTable::instance() {
  static const CoatTable table;
  return table;
}

FacetGeometry facet_geometry(const Vector3& wi, const Vector3& wo) {
  const Vector3 wh = (wi + wo).normalized();
  return {wi.z(), wo.z(), std::clamp(wi.dot(wh), 0.0, 1.0), square(wh.x()) + square(wh.y()),
          square(wh.z())};
}

Rgb evaluate_principled(const Principled& principled, const Vector3& wi, const Vector3& wo) {
  if (!(wi.z() > 0 && wo.z() > 0)) return Rgb::Zero();
  const SharedSockets<double> shared = {principled.metallic, principled.roughness,
                                        (principled.ior - 1) / (principled.ior + 1),
                                        principled.specular_tint.maxCoeff()};
  const auto light =
      principled_at_light(shared, principled_at_view(shared, wo.z()), facet_geometry(wi, wo));
  Rgb result;
  for (int c = 0; c < 3; ++c) {
    result[c] = principled_channel(light, principled.base_color[c], principled.specular_tint[c]);
  }
  return result;
}

}  // namespace lobefit
