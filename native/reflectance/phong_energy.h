// How much a lobe of Phong's reflects, for real exponents and in constant time: the integrals by
// which it is normalised, of Mallett and Yuksel, "Constant-time energy-normalization for the Phong
// specular BRDFs", The Visual Computer 36, 2020.
//
// For a viewer at theta from the normal, over the hemisphere of lights wi, with exponent n,
//
//   Phong           I_P = integral (wr.wo)^n d wi           = pi/(n+1) (1 + beta_n),
//   modified Phong  I_M = integral (wr.wo)^n (n.wi) d wi
//                       = (pi cos theta (1 + beta_{n+1}) + 2 W_n sin^{n+2} theta) / (n+2),
//
// where W_m, the integral of cos^m from 0 to pi/2, is Wallis', and beta_m, the same integral from 0
// to pi/2 - theta over W_m, is the regularised incomplete beta function I_{cos^2}(1/2, (m+1)/2).
// The paper writes I_M by beta_{n-1}, which has a pole at n = 0; one step of the recurrence
//
//   beta_m = beta_{m+2} - cos theta sin^{m+1} theta / ((m+1) W_m),   W_m = W_{m+2} (m+2)/(m+1)
//
// turns it into the sum of two positive terms above, which needs no special case.
//
// Steps of the recurrence raise a small m. For a large one put v = -ln cos phi, nu = m + 1/2: then
//
//   cos^m phi d phi = e^{-nu v} sqrt(v / sinh v) dv / sqrt(2 v),
//
// and as sqrt(v / sinh v) is a series in v^2, beta_m and W_m are series in 1/nu^2 of incomplete and
// complete gamma functions of halves, thus of erf sqrt(nu v), e^{-nu v} and polynomials. Nothing in
// it cancels: beta is needed to a rounding of 1 only, because 1 is added to it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <limits>

#include "measurement/vector3.h"

namespace lobefit {

// A view angle of 0 to 90 degrees by cosine and sine, both of full relative precision: near 90
// degrees an exponent of 1e12 needs a small cosine to all its digits.
template <std::floating_point Real>
struct ViewAngle {
  Real cosine;
  Real sine;

  // Near 90 degrees by the complement, which is exact: the cosine of an angle in radians is not.
  static ViewAngle from_degrees(Real angle) {
    constexpr Real unit = static_cast<Real>(pi / 180);
    if (angle < 45) return {std::cos(angle * unit), std::sin(angle * unit)};
    const Real complement = (90 - angle) * unit;
    return {std::sin(complement), std::cos(complement)};
  }
};

// An integral and its derivatives by the exponent and by the view angle in radians. Its reciprocal
// is the factor that makes the lobe energy-normalised: it then reflects all light at every angle.
template <std::floating_point Real>
struct PhongEnergy {
  Real value;
  Real by_exponent;
  Real by_angle;
};

namespace detail {

// W_m and beta_m with their derivatives by m, that of W_m in its logarithm.
template <std::floating_point Real>
struct WallisIntegrals {
  Real wallis;
  Real log_wallis_slope;
  Real beta;
  Real beta_slope;
};

// Coefficients (1/2)_{2k} h_k of the series sqrt(v / sinh v) = 1 + sum h_k v^{2k}. So many of them
// leave no more than a rounding where the steps have raised m to twice their number or above.
template <std::floating_point Real>
struct WallisSeries {
  static constexpr int steps = 10;
  static constexpr std::array<double, 6> terms = {-1.0 / 16,
                                                  21.0 / 512,
                                                  -671.0 / 8192,
                                                  180323.0 / 524288,
                                                  -20898423.0 / 8388608,
                                                  7426362705.0 / 268435456};
};

template <>
struct WallisSeries<float> {
  static constexpr int steps = 3;
  static constexpr std::array<float, 3> terms = {-1.0F / 16, 21.0F / 512, -671.0F / 8192};
};

// -ln sin theta; finite, so that its product with 0 is 0.
template <std::floating_point Real>
Real negative_log_sine(const ViewAngle<Real>& view) {
  const Real c = view.cosine;
  const Real value = c < view.sine ? -std::log1p(-c * c) / 2 : -std::log(view.sine);
  return std::min(value, std::sqrt(std::numeric_limits<Real>::max()));
}

// W_m and beta_m by the series, for m of twice WallisSeries::steps or more.
template <std::floating_point Real>
WallisIntegrals<Real> wallis_series(Real m, Real cosine, Real v) {
  constexpr auto terms = WallisSeries<Real>::terms;
  constexpr Real root_pi = static_cast<Real>(1.77245385090551602730);
  constexpr Real exp_vanishes = 80;
  const Real nu = m + Real(0.5), inverse2 = 1 / (nu * nu);
  std::array<Real, terms.size()> term;
  Real power = 1;
  for (std::size_t k = 0; k < terms.size(); ++k) term[k] = terms[k] * (power *= inverse2);

  // gamma(2k + 1/2, x) / Gamma(2k + 1/2) = erf sqrt x - edge (1 + x/(3/2) (1 + x/(5/2) (1 + ..))),
  // 2k brackets; `sum` has them for all k at once, `slope` the same for terms times k.
  const Real x = std::min(nu * v, exp_vanishes);
  const Real edge = 2 / root_pi * std::sqrt(x) * std::exp(-x);
  Real tail = 0, tail_slope = 0, sum = 0, slope = 0;
  for (std::size_t k = terms.size(); k > 0; --k) {
    const Real order = static_cast<Real>(2 * k);
    tail += term[k - 1];
    tail_slope += term[k - 1] * static_cast<Real>(k);
    for (const Real bracket : {order + Real(0.5), order - Real(0.5)}) {
      sum = tail + x / bracket * sum;
      slope = tail_slope + x / bracket * slope;
    }
  }
  const Real total = 1 + tail;
  const Real wallis = root_pi / std::sqrt(2 * nu) * total;
  // By nu at fixed x, and by x: beta's derivative by v is that of its integral.
  const Real by_nu = 2 * edge / (nu * total) * (slope - sum * tail_slope / total);
  const Real by_x = cosine > 0 ? v / cosine * std::exp(-(m + 1) * v) / (nu * wallis) : 0;
  return {wallis, -(Real(0.5) + 2 * tail_slope / total) / nu,
          std::erf(std::sqrt(x)) - edge * sum / total, by_nu + by_x};
}

// W_m and beta_m for m >= 0; v is -ln sin theta.
template <std::floating_point Real>
WallisIntegrals<Real> wallis_integrals(Real m, const ViewAngle<Real>& view, Real v) {
  constexpr int steps = WallisSeries<Real>::steps;
  if (m >= 2 * steps) return wallis_series(m, view.cosine, v);
  auto [wallis, log_slope, beta, beta_slope] = wallis_series(m + 2 * steps, view.cosine, v);
  // The sum of what the steps take from beta, over the last of it, that for m.
  const Real sine2 = view.sine * view.sine;
  Real sum = 0, slope = 0, inverse = 0, inverse_above = 1 / (m + 2 * steps + 1);
  for (int step = steps - 1; step >= 0; --step) {
    const Real here = m + static_cast<Real>(2 * step);
    const Real inverse_between = 1 / (here + 2);
    inverse = 1 / (here + 1);
    wallis *= (here + 2) * inverse;
    log_slope += inverse_between - inverse;
    const Real ratio = sine2 * (here + 2) * inverse_above;
    slope = ratio * ((inverse_between - inverse_above) * sum + slope);
    sum = 1 + ratio * sum;
    inverse_above = inverse;
  }
  const Real taken = view.cosine * std::exp(-(m + 1) * v) * inverse / wallis;
  return {wallis, log_slope, beta - taken * sum,
          beta_slope - taken * (slope - (v + inverse + log_slope) * sum)};
}

}  // namespace detail

// I_P for an exponent n >= 0. Within 2e-15 (double) or 1e-6 (float) of the integral for n of 0 and
// 1e-37 to 1e12. It is defined here so that what a caller leaves unused is not computed.
template <std::floating_point Real>
PhongEnergy<Real> phong_energy(Real exponent, const ViewAngle<Real>& view) {
  constexpr Real half_turn = static_cast<Real>(pi);
  const Real v = detail::negative_log_sine(view);
  const auto at = detail::wallis_integrals(exponent, view, v);
  const Real scale = half_turn / (exponent + 1), value = scale * (1 + at.beta);
  return {value, scale * at.beta_slope - value / (exponent + 1),
          -scale / at.wallis * std::exp(-exponent * v)};
}

// I_M, likewise.
template <std::floating_point Real>
PhongEnergy<Real> modified_phong_energy(Real exponent, const ViewAngle<Real>& view) {
  constexpr Real half_turn = static_cast<Real>(pi);
  const Real c = view.cosine, s = view.sine, v = detail::negative_log_sine(view);
  const auto above = detail::wallis_integrals(exponent + 1, view, v);
  // 2 W_n sin^{n+1}, by W_n W_{n+1} = pi / (2 (n+1)).
  const Real edge = half_turn / ((exponent + 1) * above.wallis) * std::exp(-(exponent + 1) * v);
  const Real mirror = half_turn * (1 + above.beta), scale = 1 / (exponent + 2);
  const Real value = (c * mirror + s * edge) * scale;
  const Real edge_slope = -edge * (v + 1 / (exponent + 1) + above.log_wallis_slope);
  return {value, (half_turn * c * above.beta_slope + s * edge_slope - value) * scale,
          (c * edge - s * mirror) * scale};
}

// The same integrals for a whole exponent >= 0 by a sum of n/2 terms: the O(n) algorithm that the
// one above replaces, and that tests and the benchmark `phong_energy` compare it with.
double summed_phong_energy(int exponent, const ViewAngle<double>& view);
double summed_modified_phong_energy(int exponent, const ViewAngle<double>& view);

}  // namespace lobefit
