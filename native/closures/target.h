// A reflectance as closures and Principled BSDFs are fitted to it.
#pragma once

#include <cstddef>
#include <vector>

#include "reflectance/reflectance.h"

namespace lobefit {

// A light, the unit half vector of it and the viewer, what the target reflects (f cos), the solid
// angle that the light stands for, what a difference of 1 in one channel adds to the error, and the
// mean of the target's channels at about the same angle between light and viewer.
struct TargetLight {
  Vector3 wi;
  Vector3 half;
  Rgb reflected;
  double solid_angle;
  double weight;
  double typical;
};

// A view angle and the lights of the whole hemisphere that the target is known for. Both sides of
// the plane of incidence count: the halves of a measurement differ.
struct TargetView {
  Vector3 wo;  // in the xz plane, x > 0
  std::vector<TargetLight> lights;
};

// The error of an approximation is sum weight |approximation - reflected| over views, lights and
// channels: the mean over all angles p between light and viewer of the relative L1 difference of
// pictures of a sphere, so that every p counts alike, with no p singled out. In a picture a view
// angle takes cos theta d(cos theta), and lights at p are spread as d wi / sin p. Black has the
// error 1.
using Target = std::vector<TargetView>;

// Samples f (1/sr, without the cosine; NaN where it is not known), which `threads` threads (0 for
// every processor) ask at once. Empty for a target that is black or nowhere known.
Target sample_target(const Reflectance& f, int threads = 1);

// The same with every so many-th view and light alone, which stand for the others; at least one of
// each. Where there are twice as many views of half the lights each, for a narrow highlight, it is
// twice as many views and half as many lights that are left out. Another choice of them has other
// views and lights.
Target thinned(const Target& target, std::size_t view_stride, std::size_t light_stride,
               std::size_t choice = 0);

// sum weight |approximation - reflected|, for f cos of an approximation in the same frame, which
// `threads` threads (0 for every processor) ask at once.
double error_of(const Target& target, const Reflectance& f_times_cosine, int threads = 1);

}  // namespace lobefit
