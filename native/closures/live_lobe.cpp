#include "closures/live_lobe.h"

#include <algorithm>
#include <cmath>

#include "closures/beckmann.h"

namespace lobefit {
namespace {

// The fitted factors; the same numbers stand in addon/nodes/live.py.
struct Correction {
  static constexpr double least_curvature = 0.87;
  static constexpr double tilt_z = 0.59, tilt_zz = -1.71;
  static constexpr double offset_alpha = -0.77;
  static constexpr double x_zz = -1.16, x_q = 1;
  static constexpr double y_z = 0.04, y_q = 12.5;
  static constexpr double weight_zz = -0.31, weight_alpha = -0.14, weight_q = 0.61;
};

double square(double x) { return x * x; }

// F at an angle of the given tangent, (ln F)' / tangent and (ln F)'', by the angle.
struct FresnelSlope {
  double value;
  double slope;
  double curvature;
};

FresnelSlope fresnel_slope(double tangent, double ior, double fresnel) {
  const double excess = (ior - 1) * (ior + 1);
  const double tan2 = square(tangent);
  const double v = excess * (1 + tan2);         // u^2 - 1
  const double d = v / (1 + std::sqrt(1 + v));  // u - 1
  const double h = v / (1 + v);
  const double rs = d / (2 + d), rp = (d - excess) / (2 + d + excess);
  const double s2 = square(rs), p2 = square(rp);
  const double value = 1 - fresnel + fresnel * (s2 + p2) / 2;
  if (!(value > 0)) return {0, 0, 0};
  const double first = fresnel / value * (rs * (1 - s2) + rp * (1 - p2)) / 2;
  const double second = fresnel / value * ((1 - 3 * s2) * (1 - s2) + (1 - 3 * p2) * (1 - p2)) / 4;
  const double bend = h * (1 + tan2 + 2 * tan2 * (1 - h));
  const double slope = first * h;
  return {value, slope, first * bend + tan2 * (second * h * h - square(slope))};
}

}  // namespace

double normal_albedo(double exponent, double interpolation) {
  const double s = exponent;
  return 2 * pi / (s + 2 - interpolation * s * (1.19 + s / 2) / (5.02 + s * (3.41 + s)));
}

LiveClosure live_closure(double cos_view, double exponent, double interpolation, double ior,
                         double fresnel) {
  using C = Correction;
  const double s = exponent, alpha = interpolation;
  const double cos_o = std::clamp(cos_view, 1e-3, 1.0);
  const double sin_o = std::sqrt(1 - square(cos_o)), tan_o = sin_o / cos_o;

  // The peak of the Phong lobe: x = tan 2tau, y = tan tau, p = cos^2 tau.
  const double x = 2 * tan_o / (s + 1 + std::sqrt(square(s + 1) + 4 * s * square(tan_o)));
  const double y = x / (1 + std::sqrt(1 + square(x)));
  const double p = 1 / (1 + square(y)), e = square(y) * p;

  // The lobe there. ln base is a series because 1 - base drowns in single precision.
  const double missing = e * (2 - alpha * e), base = 1 - missing;
  const double r = missing / (1 + base);
  const double log_base = -2 * r * (1 + square(r) * (1.0 / 3 + square(r) / 5));
  const double base_slope = 2 * y * p * (1 - alpha * e) / base;
  const double base_curvature =
      ((1 - alpha) * (1 - 2 * e) + alpha * p * (1 - 4 * e)) / base + square(base_slope);
  const double tan2_i = square(s * x);
  const double lobe_curvature = s * base_curvature + 1 + tan2_i;
  const double z = tan2_i / lobe_curvature;

  // Fresnel there, and the Newton step.
  const double tan_peak = (sin_o - cos_o * y) / (cos_o + sin_o * y);
  const FresnelSlope f = fresnel_slope(tan_peak, ior, fresnel);
  const double curvature =
      std::max(lobe_curvature - f.curvature / 4, C::least_curvature * lobe_curvature);
  const double slope = s * (base_slope - x) + f.slope * tan_peak / 2;
  const double step = slope / curvature;
  // The mirror direction of the bent normal stays above the horizon.
  const double tilt =
      std::max((y - step / 2) * (1 + z * (C::tilt_z + C::tilt_zz * z)), -0.9 * cos_o / (1 + sin_o));
  const double moved = 2 * p * (y - tilt);

  // The widths about the bent normal.
  const double shrink = 1 / std::sqrt(1 + square(tilt));
  const double c = (cos_o + sin_o * tilt) * shrink, d = (sin_o - cos_o * tilt) * shrink;
  const double m = alpha * square(p) / base;
  const double across = s * (c * c + m * (d * d - 2 * tilt * d * c)) + c * c;
  const double j = std::max(across - f.slope * (2 * c * c - 1) / 4, C::least_curvature * across);
  const double q = square(c * d / (4 * j)) * curvature;
  const double offset = 2 + C::offset_alpha * alpha;
  const double inverse_x2 = 2 * curvature * (1 + C::x_zz * z * z) / (1 + C::x_q * q) + offset;
  const double inverse_y2 = 2 * j * (1 + C::y_z * z * m) / (1 + C::y_q * q) + offset;

  const double log_peak = s * log_base + moved * (slope - curvature * moved / 2);
  const double correction =
      (1 + C::weight_zz * z * z + C::weight_alpha * alpha / (s + 1)) / (1 + C::weight_q * q);
  const double masking = 1 + 2 * beckmann_lambda(square(d / c) / inverse_x2);
  const double weight = 4 * pi * c * masking * std::exp(log_peak) * f.value * correction /
                        std::sqrt(inverse_x2 * inverse_y2 * (1 + tan2_i));
  return {tilt, 1 / std::sqrt(inverse_x2), 1 / std::sqrt(inverse_y2), weight};
}

Rgb live_lobe(const Parameters& parameters, const Vector3& wi, const Vector3& wo) {
  if (!(wi.z() > 0 && wo.z() > 0)) return Rgb::Zero();
  const Parameters lobe = as_interpolated(parameters);
  const Vector3 normal = Vector3::UnitZ();
  const double sine = std::hypot(wo.x(), wo.y());
  const Vector3 tangent =
      sine > 0 ? Vector3(wo.x() / sine, wo.y() / sine, 0) : Vector3(Vector3::UnitX());
  Rgb result = lobe.diffuse / pi * wi.z();
  for (int c = 0; c < 3; ++c) {
    const double exponent = std::clamp(lobe.exponent[c], 0.0, live_exponent_limit);
    const LiveClosure at =
        live_closure(wo.z(), exponent, lobe.interpolation, lobe.ior.value_or(1), lobe.ior ? 1 : 0);
    const double shrink = 1 / std::sqrt(1 + square(at.tilt));
    const Beckmann closure{(normal + at.tilt * tangent) * shrink,
                           (tangent - at.tilt * normal) * shrink, at.alpha_x, at.alpha_y};
    const double same_albedo = normal_albedo(lobe.exponent[c], lobe.interpolation) /
                               normal_albedo(exponent, lobe.interpolation);
    result[c] += lobe.specular[c] * same_albedo * at.weight * evaluate_beckmann(closure, wi, wo);
  }
  return result;
}

}  // namespace lobefit
