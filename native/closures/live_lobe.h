// The interpolated lobe as the node group 'Lobefit Live' renders it: two Beckmann closures, one
// with a bent normal and a broad one, whose parameters are formulas of the view angle, plus a
// diffuse closure.
//
// Derivation. Let the viewer stand at the angle theta and the light in the plane of incidence, at
// theta + a on the other side; b turns the light out of that plane. Bend a closure's normal by tau
// toward the viewer. Then a = -2 tau is where light and viewer mirror each other about the bent
// normal, which is where the closure peaks; it has to be the peak of the lobe,
//
//   ln(f cos) = s ln base + ln cos(theta + a) + ln F(theta + a/2).
//
// 1. Tilt. Fresnel's slope at the mirror direction is that of the light's cosine but for the sign
//    and a factor phi = (ln F)' / (2 tan theta); so both together pull the peak like the cosine's
//    share 1 - phi. For alpha = 0 the peak is then a root of s tan 2tau = (1 - phi) tan(theta -
//    2tau),
//      x = tan 2tau = 2 (1 - phi) t / (s + 1 - phi + sqrt((s + 1 - phi)^2 + 4 s (1 - phi) t^2)),
//    t = tan theta. It is exact at any angle where F = 1. The peaks of the other alpha differ from
//    it by the cube of tau only.
// 2. Widths. The curvature of ln(f cos) there is H = s (1 + (1 - 3/4 alpha) x^2) + (1 - phi/2)
//    (1 + (s x / (1 - phi))^2) in the plane and j = s (alpha + (1 - alpha) c^2) + c^2 - phi (c^2 -
//    1/2) out of it, over c^2, where c = cos(theta - tau). Beckmann's ln(f cos) falls off as
//    (1/alpha_x^2 - 2) a^2/4 and as (1/alpha_y^2 - 2) b^2 / (4 c^2), which gives both roughnesses,
//    2 H + 2 and 2 j + 2. They are written as 1 + 2 H exp(correction), which is never a roughness
//    over 1; the correction of narrow lobes, half of 1/(s + 1), is the other 1.
// 3. Weight. It makes the peaks equal. Cycles' masking is 1 wherever a lobe is narrow; what it
// takes
//    from wide ones is left to the corrections.
// 4. F = 1 + fresnel (R_F - 1). With u = sqrt(ior^2 - 1 + cos^2)/cos both amplitudes are
//    r = (u - r0)/(u + r0) for r0 = 1 and ior^2, and dr/d(ln u) = (1 - r^2)/2: that gives (ln F)'
//    in a few products.
//
// Second order is exact for narrow lobes. In a wide one the light's cosine cuts off the side toward
// the horizon, which no single closure can: there one needs a sharper one, more bent, above a broad
// one that is not bent at all. The broad one takes a share of the peak that falls as 1/(s + 1) and
// ends at 0 for narrow lobes, where Cycles drops the closure. Its roughnesses are those of base^s
// about the mirror direction, 1/alpha_x^2 = 1 + s and 1/alpha_y^2 = 1 + s (alpha + (1 - alpha)
// cos^2 theta), but for a factor.
//
// The logarithms of tilt, widths, weight and share get corrections, which are sums of products of
// small numbers: 1/(s + 1); z, the share of the light's cosine in H; phi; u = sin^2 theta; and how
// far F has risen above its value at normal incidence. All but 1/(s + 1) vanish at normal
// incidence, so that a facing surface is isotropic. Their factors (`Correction` in the .cpp) were
// fitted to eq. 3 of Nielsen et al. by the relative L1 of f cos over all lights and views to 84
// degrees, as spheres show them (each angle between light and viewer counts alike), for s 0.1..100,
// alpha 0, .5 and 1, without Fresnel and with indices 1.2 to 2.5.
#pragma once

#include "measurement/vector3.h"
#include "reflectance/model.h"

namespace lobefit {

// One Beckmann closure: tan(tau) toward the viewer, the roughness in the plane of incidence and
// across it, and the weight.
struct LiveClosure {
  double tilt;
  double alpha_x;
  double alpha_y;
  double weight;
};

struct LiveClosures {
  LiveClosure bent;
  LiveClosure broad;
};

// The closures for k_s = 1. cos_view in [0, 1] (kept from 0.001 up), exponent in
// [0, live_exponent_limit], interpolation in [0, 1], ior >= 1; fresnel in [0, 1] blends R_F with 1.
LiveClosures live_closures(double cos_view, double exponent, double interpolation, double ior,
                           double fresnel);

// Sharper lobes than this are drawn as this one, with the same albedo: single precision in Cycles
// loses the peak of a sharper one.
inline constexpr double live_exponent_limit = 1e5;

// The albedo at normal incidence of the lobe with k_s = 1 and no Fresnel, the integral of
// base^s cos. Exact for alpha = 0, within 0.15 % otherwise; the node group divides by it and
// addon/nodes/live.py multiplies by it, so what it misses cancels.
double normal_albedo(double exponent, double interpolation);

// What both closures for k_s = 1 reflect of a white world, and the sum of their weights. The ratio,
// what masking leaves, is 0.5 to 1 and hardly depends on Fresnel. Until release 4.5, samples of a
// closure that Cycles draws may end between the horizon of the surface and that of the bent
// closure, where its evaluation for lamps is 0; since 5.0 they may not.
struct LiveAlbedo {
  double until_4_5;
  double since_5_0;
  double weight;
};

// By quadrature over half vectors; the arguments are those of live_closures.
LiveAlbedo live_albedo(double cos_view, double exponent, double interpolation, double ior,
                       double fresnel);

// f cos(theta_i) in 1/sr, specular and diffuse, for unit vectors toward the light (wi) and the
// viewer (wo), n = +z; 0 below the horizon. Any model of `parameters` is one interpolated lobe.
Rgb live_lobe(const Parameters& parameters, const Vector3& wi, const Vector3& wo);

}  // namespace lobefit
