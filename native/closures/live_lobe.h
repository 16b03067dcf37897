// The interpolated lobe as the node group 'Lobefit Live' renders it: one Beckmann closure with a
// bent normal, whose parameters are formulas of the view angle, plus a diffuse closure.
//
// Derivation. Let the viewer stand at the angle theta and the light in the plane of incidence, at
// theta + a on the other side; b turns the light out of that plane. Bend the closure's normal by
// tau toward the viewer. Then a = -2 tau is where light and viewer mirror each other about the bent
// normal, which is where the closure peaks; it has to be the peak of the lobe,
//
//   ln(f cos) = s ln base + ln cos(theta + a) + ln F(theta + a/2).
//
// 1. Tilt. For alpha = 0 and F = 1 the peak is a root of s tan 2tau = tan(theta - 2tau), so
//    x = tan 2tau = 2t / (s + 1 + sqrt((s+1)^2 + 4 s t^2)), t = tan theta, is exact at any angle.
//    The other lobes take one Newton step from there: the slope s (ln base)' - s x + (ln F)'/2 over
//    the curvature H = -s (ln base)'' + 1 + (s x)^2, less (ln F)''/4.
// 2. Widths. Beckmann's ln(f cos) falls off as (1/alpha_x^2 - 2) a^2/4 in the plane and as
//    (1/alpha_y^2 - 2) b^2 / (4 cos^2 theta') out of it, theta' = theta - tau. So
//      1/alpha_x^2 = 2 H + 2,   1/alpha_y^2 = 2 (s k + cos^2 theta') + 2,
//      k = cos^2 theta' + m (sin^2 theta' - 2 tan tau sin theta' cos theta'),
//    where m = alpha cos^4 tau / base is the share of Blinn's cosine at the peak, and F takes
//    (ln F)' (cos^2 theta' - sin^2 theta') / (4 tan theta') from the second bracket.
// 3. Weight. It makes the peaks equal, with the Lambda of Cycles' own masking.
// 4. F = 1 + fresnel (R_F - 1). With u = sqrt(ior^2 - 1 + cos^2)/cos both amplitudes are
//    r = (u - r0)/(u + r0) for r0 = 1 and ior^2, and dr/d(ln u) = (1 - r^2)/2: that gives (ln F)'
//    and (ln F)'' in a few products.
//
// Second order is exact for narrow lobes. Three small numbers say how far a wide one is from that:
// z = (s x)^2/H, the share of the light's cosine in the curvature; q, the square of how far the
// lobe curves away within its own width; and 1/(s+1). The factors in them (`Correction` in the
// .cpp) were fitted to eq. 3 of Nielsen et al. by the relative L1 of f cos over the hemisphere of
// lights, for s 1.5..2000, alpha 0..1, view angles 4..83 degrees, with and without Fresnel.
#pragma once

#include "measurement/vector3.h"
#include "reflectance/model.h"

namespace lobefit {

// The one closure for k_s = 1: tan(tau) toward the viewer, the roughness in the plane of incidence
// and across it, and the weight.
struct LiveClosure {
  double tilt;
  double alpha_x;
  double alpha_y;
  double weight;
};

// cos_view in [0, 1] (kept from 0.001 up), exponent in [0, live_exponent_limit], interpolation in
// [0, 1], ior >= 1; fresnel in [0, 1] blends R_F with 1.
LiveClosure live_closure(double cos_view, double exponent, double interpolation, double ior,
                         double fresnel);

// Sharper lobes than this are drawn as this one, with the same albedo: single precision in Cycles
// loses the peak of a sharper one.
inline constexpr double live_exponent_limit = 1e5;

// The albedo at normal incidence of the lobe with k_s = 1 and no Fresnel, the integral of
// base^s cos. Exact for alpha = 0, within 0.15 % otherwise; the node group divides by it and
// addon/nodes/live.py multiplies by it, so what it misses cancels.
double normal_albedo(double exponent, double interpolation);

// f cos(theta_i) in 1/sr, specular and diffuse, for unit vectors toward the light (wi) and the
// viewer (wo), n = +z; 0 below the horizon. Any model of `parameters` is one interpolated lobe.
Rgb live_lobe(const Parameters& parameters, const Vector3& wi, const Vector3& wo);

}  // namespace lobefit
