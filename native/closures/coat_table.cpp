#include "closures/coat_table.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "closures/principled_terms.inc"
#include "measurement/vector3.h"

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
  std::array<double, nodes> positions;
  std::array<DielectricTerms, nodes> coats;
  for (std::size_t i = 0; i < nodes; ++i) {
    positions[i] = std::max(double(i) / (nodes - 1), 1e-4);
    coats[i] = dielectric_terms(square(std::min(positions[i], 0.99)));
  }
  auto* value = values_.data();
  for (const double roughness : positions) {
    for (const double n_wo : positions) {
      std::array<double, nodes> sums{};
      const int points = visit_visible_normals(roughness, n_wo, [&](double cosine) {
        for (std::size_t i = 0; i < nodes; ++i) {
          sums[i] += schlick_weight<false>(coats[i], cosine).value;
        }
      });
      for (const double sum : sums) *value++ = static_cast<float>(sum / points);
    }
  }
}

const CoatTable& CoatTable::instance() {
  static const CoatTable table;
  return table;
}

CoatTable::Share CoatTable::operator()(double roughness, double n_wo, double root_ior) const {
  const auto locate = [](double x) {
    return std::clamp(static_cast<int>(x * (nodes - 1)), 0, nodes - 2);
  };
  const int r = locate(roughness), c = locate(n_wo), i = locate(root_ior);
  const double across = n_wo * (nodes - 1) - c;
  const auto at = [&](int dr, int di) {
    return std::lerp(node(r + dr, c, i + di), node(r + dr, c + 1, i + di), across);
  };
  const double along = root_ior * (nodes - 1) - i, up = roughness * (nodes - 1) - r;
  const double low_by_root = at(0, 1) - at(0, 0), high_by_root = at(1, 1) - at(1, 0);
  const double low = at(0, 0) + low_by_root * along, high = at(1, 0) + high_by_root * along;
  return {low + (high - low) * up, (high - low) * (nodes - 1),
          (low_by_root + (high_by_root - low_by_root) * up) * (nodes - 1)};
}

}  // namespace lobefit
