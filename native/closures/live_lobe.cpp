#include "closures/live_lobe.h"

#include <algorithm>
#include <cmath>

#include "closures/microfacet.h"

namespace lobefit {
namespace {

// The fitted numbers of the corrections, by what is corrected and what they are multiplied by; the
// same stand in addon/nodes/live.py.
struct Correction {
  static constexpr double tilt_z = 2.53, tilt_zu = -2.21, tilt_uu = -0.398, tilt_rise = -5.28;
  static constexpr double both = 0.482, both_wide = 0.741, both_alpha = -0.342;
  static constexpr double x_z = 6.34, x_zwide = -9.81, x_phi = -1.21, x_phi2 = 0.888;
  static constexpr double y_z = 2.56, y_zz = 10.6;
  static constexpr double weight_zz = -27.2, weight_wide = -0.426, weight_alpha = -0.115,
                          weight_phi2 = 0.223, weight_rise = -1.49;
  static constexpr double broad_wide = 1.11;
  static constexpr double broad_x_z = -2.12, broad_x_zz = 6.95, broad_x_rise = 1.9;
  static constexpr double broad_y_alpha = 1.79, broad_y_phi2 = -0.975;
  static constexpr double share = -1.95, share_wide = 0.958, share_rise = -1.28;
  static constexpr double share_z = 6.78, share_zz = -15, share_zphi = -2.18;
  static constexpr double share_end = 0.004;
};

// (ln F)' of Fresnel pulls the peak toward the horizon, the light's cosine away from it; at least
// this much of the latter is left.
constexpr double least_pull = 0.05;

// F, half of (ln F)' / tan (phi) and (F - F0) / (F + F0), F0 at normal incidence (rise).
struct Fresnel {
  double value;
  double phi;
  double rise;
};

Fresnel fresnel_terms(double tan2, double ior, double fresnel) {
  const double less = ior - 1, more = ior + 1, excess = less * more;
  const double v = excess * (1 + tan2);         // u^2 - 1
  const double d = v / (1 + std::sqrt(1 + v));  // u - 1
  const double rs = d / (2 + d), rp = (d - excess) / (2 + d + excess);
  const double s2 = square(rs), p2 = square(rp);
  const double value = 1 + fresnel * ((s2 + p2) / 2 - 1);
  if (!(value > 0)) return {0, 0, 0};
  const double facing = 1 + fresnel * (square(less / more) - 1);
  const double slope = fresnel / value * (rs * (1 - s2) + rp * (1 - p2)) * v / (1 + v);
  return {value, slope / 4, (value - facing) / (value + facing)};
}

// Half vectors are taken by equal parts of D (n'.wh) d wh, which is a Gaussian of their slopes, so
// that a narrow closure costs no more than a wide one.
LiveAlbedo white_albedo(const LiveClosure& closure, const Vector3& wo) {
  constexpr int rings = 40, sectors = 48;  // within 1e-3
  const Shape shape{std::log(closure.alpha_x), std::log(closure.alpha_y), closure.tilt};
  const Microfacet microfacet(Distribution::beckmann, shape, wo);
  const double shrink = 1 / std::sqrt(1 + square(closure.tilt));
  const Vector3 normal(closure.tilt * shrink, 0, shrink), along(shrink, 0, -closure.tilt * shrink);
  double sampled = 0, beyond = 0;
  for (int ring = 0; ring < rings; ++ring) {
    // Rings crowd where slopes are large.
    const double root = 1 - (ring + 0.5) / rings, slope = std::sqrt(-2 * std::log(root));
    for (int sector = 0; sector < sectors; ++sector) {
      // The plane of incidence is a plane of symmetry: half a turn is enough.
      const double phi = (sector + 0.5) * pi / sectors;
      const Vector3 half = closure.alpha_x * slope * std::cos(phi) * along +
                           closure.alpha_y * slope * std::sin(phi) * Vector3::UnitY() + normal;
      const double incidence = wo.dot(half);
      const Vector3 wi = 2 * incidence / half.squaredNorm() * half - wo;
      if (!(incidence > 0 && wi.z() > 0)) continue;
      const double part = 2 * root * incidence * microfacet.visible(wi);
      sampled += part;
      if (normal.dot(wi) <= 0) beyond += part;
    }
  }
  const double scale = closure.weight / (rings * sectors * normal.dot(wo));
  return {sampled * scale, (sampled - beyond) * scale, closure.weight};
}

}  // namespace

double normal_albedo(double exponent, double interpolation) {
  const double s = exponent;
  return 2 * pi / (s + 2 - interpolation * s * (1.19 + s / 2) / (5.02 + s * (3.41 + s)));
}

LiveClosures live_closures(double cos_view, double exponent, double interpolation, double ior,
                           double fresnel) {
  using C = Correction;
  const double s = exponent, alpha = interpolation;
  const double cos_o = std::clamp(cos_view, 1e-3, 1.0), sin2_o = 1 - square(cos_o);
  const double sin_o = std::sqrt(sin2_o), tan_o = sin_o / cos_o, tan2_o = square(tan_o);
  const Fresnel f = fresnel_terms(tan2_o, ior, fresnel);

  // The peak of the Phong lobe: x = tan 2tau, y = tan tau, e = sin^2 tau.
  const double pull = std::max(1 - f.phi, least_pull), sum = s + pull;
  const double x = 2 * pull * tan_o / (sum + std::sqrt(square(sum) + 4 * s * pull * tan2_o));
  const double x2 = square(x), y = x / (1 + std::sqrt(1 + x2));
  const double e = square(y) / (1 + square(y)), missing = e * (2 - alpha * e);
  const double log_base = -2 * missing / (2 - missing);
  const double tan2_i = square(s * x / pull), sec2_i = 1 + tan2_i;
  const double curvature = s * (1 + x2 * (1 - 0.75 * alpha)) + (1 + pull) / 2 * sec2_i;

  const double z = pull * tan2_i / curvature, wide = 1 / (s + 1);
  const double phi2 = square(f.phi), wide_rise = wide * f.rise;

  // The bent closure.
  const double tilt = y * std::exp(z * (C::tilt_z + C::tilt_zu * sin2_o) +
                                   C::tilt_uu * wide * square(sin2_o) + C::tilt_rise * wide_rise);
  const double shrink = 1 / std::sqrt(1 + square(tilt));
  const double c = (cos_o + sin_o * tilt) * shrink, c2 = square(c);
  const double across = s * (alpha + (1 - alpha) * c2) + c2 - f.phi * (c2 - 0.5);
  const double both = wide * (C::both + C::both_wide * wide + C::both_alpha * alpha);
  const double log_x =
      both + wide * (z * (C::x_z + C::x_zwide * wide) + C::x_phi * f.phi + C::x_phi2 * wide * phi2);
  const double log_y = both + wide * z * (C::y_z + C::y_zz * z);
  const double inverse_x2 = 1 + 2 * curvature * std::exp(log_x);
  const double inverse_y2 = 1 + 2 * across * std::exp(log_y);
  const double log_peak =
      s * log_base - 2 * f.phi * tan_o * tilt * shrink +
      wide * (C::weight_zz * z * z + C::weight_wide * wide + C::weight_alpha * alpha +
              C::weight_phi2 * phi2 + C::weight_rise * f.rise);
  const double weight =
      4 * pi * f.value * c * std::exp(log_peak) / std::sqrt(inverse_x2 * inverse_y2 * sec2_i);

  // The broad one.
  const double broad = C::broad_wide * wide * wide;
  const double broad_log_x =
      broad + z * (C::broad_x_z + C::broad_x_zz * z) + C::broad_x_rise * wide_rise;
  const double broad_log_y = broad + C::broad_y_alpha * alpha * z + C::broad_y_phi2 * phi2;
  const double broad_x2 = 1 + s * std::exp(broad_log_x);
  const double broad_y2 = 1 + s * (alpha + (1 - alpha) * square(cos_o)) * std::exp(broad_log_y);
  const double log_share = C::share + C::share_wide * wide + C::share_rise * wide_rise +
                           z * (C::share_z + C::share_zz * wide * z + C::share_zphi * f.phi);
  const double share = std::max(wide * std::exp(log_share) - C::share_end, 0.0);
  const double broad_weight = 4 * pi * f.value * cos_o * share / std::sqrt(broad_x2 * broad_y2);

  return {{tilt, 1 / std::sqrt(inverse_x2), 1 / std::sqrt(inverse_y2), weight},
          {0, 1 / std::sqrt(broad_x2), 1 / std::sqrt(broad_y2), broad_weight}};
}

LiveAlbedo live_albedo(double cos_view, double exponent, double interpolation, double ior,
                       double fresnel) {
  const auto [bent, broad] = live_closures(cos_view, exponent, interpolation, ior, fresnel);
  const Vector3 wo(std::sqrt(1 - square(cos_view)), 0, cos_view);
  const LiveAlbedo a = white_albedo(bent, wo), b = white_albedo(broad, wo);
  return {a.until_4_5 + b.until_4_5, a.since_5_0 + b.since_5_0, a.weight + b.weight};
}

Rgb live_lobe(const Parameters& parameters, const Vector3& wi, const Vector3& wo) {
  if (!(wi.z() > 0 && wo.z() > 0)) return Rgb::Zero();
  const Parameters lobe = as_interpolated(parameters);
  const auto [light, viewer] = turned_to_viewer(wi, wo);
  const Vector3 half = (light + viewer).normalized();
  const auto evaluate = [&half, &light = light, &viewer = viewer](const LiveClosure& closure) {
    const Shape shape{std::log(closure.alpha_x), std::log(closure.alpha_y), closure.tilt};
    return closure.weight * Microfacet(Distribution::beckmann, shape, viewer).evaluate(light, half);
  };
  Rgb result = lobe.diffuse / pi * wi.z();
  for (int c = 0; c < 3; ++c) {
    const double exponent = std::clamp(lobe.exponent[c], 0.0, live_exponent_limit);
    const LiveClosures at =
        live_closures(wo.z(), exponent, lobe.interpolation, lobe.ior.value_or(1), lobe.ior ? 1 : 0);
    const double same_albedo = normal_albedo(lobe.exponent[c], lobe.interpolation) /
                               normal_albedo(exponent, lobe.interpolation);
    result[c] += lobe.specular[c] * same_albedo * (evaluate(at.bent) + evaluate(at.broad));
  }
  return result;
}

}  // namespace lobefit
