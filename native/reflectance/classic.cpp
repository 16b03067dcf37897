#include "reflectance/classic.h"

#include <boost/math/tools/minima.hpp>
#include <cmath>
#include <vector>

namespace lobefit {
namespace {

double mirrored_cosine(const Vector3& light, const Vector3& viewer) {
  return 2 * light.z() * viewer.z() - light.dot(viewer);
}

// Where a term is not positive it is cut, also for the exponent 0.
double cut_power(double cosine, double exponent) {
  return cosine > 0 ? std::pow(cosine, exponent) : 0;
}

// Both terms at lights that are spread by their half vectors, in rings around the normal that hold
// equal parts of a lobe (N.H)^(s/2): one that is wider than all that is compared.
class Highlights {
 public:
  Highlights(double exponent, std::optional<double> view_angle) {
    for (int ring = 0; ring < rings; ++ring) {
      const double spread = exponent / 2 + 1;
      const double cos_h = std::pow((ring + 0.5) / rings, 1 / spread);
      const double width = std::pow(cos_h, 1 - spread) / (spread * rings);
      cos_h_.push_back(cos_h);
      starts_.push_back(lights_.size());
      if (view_angle) {
        add_ring(exponent, std::cos(*view_angle), cos_h, width, sectors_of_one_view);
        continue;
      }
      // A sphere shows view angles as the projected area does, evenly by cos^2.
      for (int view = 0; view < views; ++view) {
        add_ring(exponent, std::sqrt((view + 0.5) / views), cos_h, width, sectors);
      }
    }
    starts_.push_back(lights_.size());
  }

  // The integral of |(N.H)^s' - (R.V)^s| over that of (R.V)^s.
  double difference(double blinn_exponent) const {
    double apart = 0;
    for (std::size_t ring = 0; ring < cos_h_.size(); ++ring) {
      const double blinn = std::pow(cos_h_[ring], blinn_exponent);
      for (std::size_t i = starts_[ring]; i < starts_[ring + 1]; ++i) {
        apart += lights_[i].weight * std::abs(blinn - lights_[i].phong);
      }
    }
    return apart / total_;
  }

 private:
  static constexpr int rings = 160, views = 48, sectors = 64;
  // Along a sector the two terms cross at nearly the same exponent for all rings, which a single
  // view does not smooth.
  static constexpr int sectors_of_one_view = 2048;

  struct Light {
    double weight, phong;
  };

  // d wi = 4 (V.H) d wh; half a turn is enough.
  void add_ring(double exponent, double cos_v, double cos_h, double width, int count) {
    const Vector3 viewer(std::sqrt(1 - cos_v * cos_v), 0, cos_v);
    const double sin_h = std::sqrt(1 - cos_h * cos_h);
    for (int sector = 0; sector < count; ++sector) {
      const double phi = (sector + 0.5) * pi / count;
      const Vector3 half(sin_h * std::cos(phi), sin_h * std::sin(phi), cos_h);
      const double incidence = viewer.dot(half);
      const Vector3 light = 2 * incidence * half - viewer;
      if (!(incidence > 0 && light.z() > 0)) continue;
      const double phong = cut_power(mirrored_cosine(light, viewer), exponent);
      const double weight = incidence * width / count;
      lights_.push_back({weight, phong});
      total_ += weight * phong;
    }
  }

  std::vector<double> cos_h_;
  std::vector<std::size_t> starts_;  // of each ring in lights_, and the end
  std::vector<Light> lights_;
  double total_ = 0;
};

}  // namespace

Rgb evaluate_classic(const ClassicMaterial& material, const Vector3& light, const Vector3& viewer) {
  if (!(light.z() > 0)) return Rgb::Zero();
  const double cosine =
      material.half_vector ? (light + viewer).normalized().z() : mirrored_cosine(light, viewer);
  const Rgb power = material.exponent.unaryExpr([=](double s) { return cut_power(cosine, s); });
  return material.diffuse * light.z() + material.specular * power;
}

Reflectance classic_reflectance(const ClassicMaterial& material) {
  return [material](const Vector3& wi, const Vector3& wo) -> Rgb {
    return evaluate_classic(material, wi, wo) / pi;
  };
}

ExponentMatch match_exponent(double exponent, std::optional<double> view_angle) {
  const Highlights highlights(exponent, view_angle);
  const auto by_logarithm = [&](double log) { return highlights.difference(std::exp(log)); };
  // Half the digits: more of a minimum cannot be told.
  const auto [log, error] = boost::math::tools::brent_find_minima(by_logarithm, std::log(exponent),
                                                                  std::log(8 * exponent + 8), 26);
  return {std::exp(log), error, highlights.difference(4 * exponent)};
}

}  // namespace lobefit
