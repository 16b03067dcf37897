#include "closures/closure_set.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

namespace lobefit {
namespace {

Rgb at(const RgbCurve& curve, double cosine) {
  return {curve[0](cosine), curve[1](cosine), curve[2](cosine)};
}

}  // namespace

ClosureSockets to_sockets(const Shape& shape, const Vector3& wo) {
  const double ratio = std::exp((shape.log_alpha_x - shape.log_alpha_y) / 2);
  return {std::exp((shape.log_alpha_x + shape.log_alpha_y) / 4),
          ratio <= 1 ? 1 - ratio : 1 / ratio - 1,
          wo.x() > 0 ? shape.tilt / (wo.x() - shape.tilt * wo.z()) : 0};
}

Shape to_shape(const ClosureSockets& sockets, const Vector3& wo) {
  const double log_alpha = 2 * std::log(std::clamp(sockets.roughness, 1e-6, 1.0));
  const double anisotropy = std::clamp(sockets.anisotropy, -0.99, 0.99);
  const double half_ratio = -std::copysign(std::log1p(-std::abs(anisotropy)), anisotropy);
  return {std::min(log_alpha + half_ratio, 0.0), std::min(log_alpha - half_ratio, 0.0),
          sockets.bend * wo.x() / (1 + sockets.bend * wo.z())};
}

ClosuresAtView::ClosuresAtView(const ClosureSet& closures, const Vector3& wo)
    : wo_(wo), diffuse_(at(closures.diffuse, wo.z()) / pi) {
  const double cosine = wo.z();
  if (pi * diffuse_.mean() < least_weight) diffuse_ = 0;
  for (const SpecularClosure& specular : closures.specular) {
    const Rgb weight = at(specular.weight, cosine);
    if (weight.mean() < least_weight) continue;
    const Shape shape = to_shape(
        {specular.roughness(cosine), specular.anisotropy(cosine), specular.bend(cosine)}, wo);
    specular_.emplace_back(Microfacet(specular.distribution, shape, wo), weight);
  }
}

Rgb ClosuresAtView::evaluate(const Vector3& wi, const Vector3& half) const {
  Rgb result = diffuse_ * wi.z();
  for (const auto& [closure, weight] : specular_) result += weight * closure.evaluate(wi, half);
  return result;
}

Reflectance closures_reflectance(ClosureSet closures) {
  struct Seen {
    std::shared_ptr<const ClosureSet> closures;
    ClosuresAtView at_view;
  };
  return [shared = std::make_shared<const ClosureSet>(std::move(closures))](
             const Vector3& wi, const Vector3& wo) -> Rgb {
    static thread_local std::optional<Seen> last;
    if (!(wi.z() > 0 && wo.z() > 0)) return Rgb::Zero();
    const auto [light, viewer] = turned_to_viewer(wi, wo);
    if (!last || last->closures != shared || last->at_view.wo() != viewer) {
      last = Seen{shared, ClosuresAtView(*shared, viewer)};
    }
    return last->at_view.evaluate(light, (light + viewer).normalized());
  };
}

}  // namespace lobefit
