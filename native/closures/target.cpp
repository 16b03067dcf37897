#include "closures/target.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "closures/view_curve.h"
#include "measurement/parallel.h"

namespace lobefit {
namespace {

// Where a highlight is narrow, there are twice as many views with every second light, so that
// closures are held between views too: NP-MERL chrome's, fitted at 162 views, were off by .124 at
// these and by .145 on a sphere; at 324 by .118 and .135.
constexpr int fewest_views = 162, rings = 28, sectors = 14;
// sqrt(cos theta) of the views: evenly spaced, so that they crowd at grazing angles, where
// reflectance changes fastest.
constexpr double least_root = ViewSplines::least_root;
// Views flatter than this are a hundredth of a sphere's picture, but can be so bright, or measured
// so badly, that they would rule all others.
constexpr double least_picture_cosine = 0.1;
// A highlight is narrow whose half vectors are nearer to the normal.
constexpr double narrow = radians(1);
// What is darker is black and what is brighter could make sums infinite; no reflectance comes near.
constexpr double darkest = 1e-12, brightest = 1e30;

// An angle p between light and viewer among the hats of SumByPhase: between two of them, or at an
// end.
struct Phase {
  std::size_t below;
  double share;  // of the hat after it
};

// The sum of an amount over all samples at about one angle p between light and viewer, as a
// function of p: hats of 5 degrees, constant beyond the first and the last, where pictures hold
// next to nothing.
class SumByPhase {
 public:
  static constexpr std::size_t count = 33;
  static Phase place(double cosine) {
    const double phase = degrees(std::acos(std::clamp(cosine, -1.0, 1.0)));
    const double at = (std::clamp(phase, first, last) - first) / step;
    const auto below = std::min(static_cast<std::size_t>(at), count - 2);
    return {below, at - static_cast<double>(below)};
  }
  void add(const Phase& at, double amount) {
    sums_[at.below] += (1 - at.share) * amount;
    sums_[at.below + 1] += at.share * amount;
  }
  double operator()(const Phase& at) const {
    return (1 - at.share) * sums_[at.below] + at.share * sums_[at.below + 1];
  }

 private:
  static constexpr double step = 5, first = 5, last = 165;
  std::array<double, count> sums_{};
};

// The share of a sphere's picture, 2 cos d(cos), that one of so many views stands for.
double picture_share(double cosine, int views) {
  return 4 * cosine * std::sqrt(cosine) * (1 - least_root) / views;
}

// Of each sector the cosine and sine of its middle. A quarter of a step off, no azimuth is the
// mirror image of another.
const std::array<std::array<double, 2>, sectors>& azimuths() {
  static const auto table = [] {
    std::array<std::array<double, 2>, sectors> azimuths;
    for (std::size_t sector = 0; sector < sectors; ++sector) {
      const double phi = (static_cast<double>(sector) + 0.25) * (2 * pi / sectors);
      azimuths[sector] = {std::cos(phi), std::sin(phi)};
    }
    return azimuths;
  }();
  return table;
}

// Half vectors on rings that crowd toward the normal as the square of their number, where the
// highlight is; the offset keeps the rings of neighbouring views from repeating each other.
// Of the sectors every so many, from the first that is asked for.
TargetView sample_view(const Reflectance& f, const Vector3& wo, double share, double offset,
                       int first_sector, int sector_step) {
  TargetView view{wo, {}};
  for (int ring = 0; ring < rings; ++ring) {
    const double t = (ring + offset) / rings;
    const double theta_h = t * t * (pi / 2), width = t * pi / rings;
    const double sin_h = std::sin(theta_h), cos_h = std::cos(theta_h);
    for (int sector = first_sector; sector < sectors; sector += sector_step) {
      const auto& [cos_phi, sin_phi] = azimuths()[static_cast<std::size_t>(sector)];
      const Vector3 half(sin_h * cos_phi, sin_h * sin_phi, cos_h);
      const double incidence = wo.dot(half);
      const Vector3 wi = 2 * incidence * half - wo;
      if (!(incidence > 0 && wi.z() > 0)) continue;
      const Rgb value = f(wi, wo) * wi.z();
      if (!value.isFinite().all()) continue;
      const double solid_angle = 4 * incidence * sin_h * width * (2 * pi / sectors * sector_step);
      const double sin_phase = std::sqrt(std::max(0.0, 1 - wi.dot(wo) * wi.dot(wo)));
      view.lights.push_back({wi, half, value.cwiseMin(brightest).cwiseMax(0), solid_angle,
                             share * solid_angle / std::max(sin_phase, 0.05), 0});
    }
  }
  return view;
}

// The angle of half vectors and normal beyond which a viewer at 45 degrees sees less than half of
// what is brightest nearer to it.
double highlight_width(const Reflectance& f) {
  constexpr int steps = 90;
  const Vector3 wo(std::sqrt(0.5), 0, std::sqrt(0.5));
  double brightest_yet = 0;
  for (int i = 0; i < steps; ++i) {
    const double theta_h = square((i + 0.5) / steps) * pi / 2;
    double sum = 0;
    for (const auto& [cos_phi, sin_phi] : azimuths()) {
      const Vector3 half(std::sin(theta_h) * cos_phi, std::sin(theta_h) * sin_phi,
                         std::cos(theta_h));
      const Vector3 wi = 2 * wo.dot(half) * half - wo;
      if (wi.z() > 0) {
        const Rgb value = f(wi, wo) * wi.z();
        if (value.isFinite().all()) sum += value.sum();
      }
    }
    if (sum < brightest_yet / 2) return theta_h;
    brightest_yet = std::max(brightest_yet, sum);
  }
  return pi / 2;
}

}  // namespace

Target sample_target(const Reflectance& f, int threads) {
  const int finer = highlight_width(f) < narrow ? 2 : 1, views = finer * fewest_views;
  const auto count = static_cast<std::size_t>(views);
  Target target(count);
  std::vector<std::vector<Phase>> phases(count);  // of each light
  parallel_for(views, thread_count(threads), [&](int i) {
    constexpr double golden = 0.6180339887498949;
    const double root = least_root + (1 - least_root) * (i + 0.5) / views;
    const double cosine = root * root;
    const Vector3 wo(std::sqrt(1 - cosine * cosine), 0, cosine);
    const double offset = std::fmod(0.5 + golden * i, 1.0);
    const auto at = static_cast<std::size_t>(i);
    target[at] =
        sample_view(f, wo, picture_share(cosine, views), std::max(offset, 0.02), i % finer, finer);
    for (const TargetLight& light : target[at].lights) {
      phases[at].push_back(SumByPhase::place(light.wi.dot(wo)));
    }
  });
  SumByPhase light, weight;
  double all_light = 0, all_weight = 0;
  for (std::size_t v = 0; v < target.size(); ++v) {
    const TargetView& view = target[v];
    if (view.wo.z() < least_picture_cosine) continue;
    for (std::size_t i = 0; i < view.lights.size(); ++i) {
      const TargetLight& at = view.lights[i];
      const double reflected = at.weight * at.reflected.sum();
      light.add(phases[v][i], reflected);
      weight.add(phases[v][i], 3 * at.weight);
      all_light += reflected;
      all_weight += 3 * at.weight;
    }
  }
  if (!(all_light > darkest * all_weight)) return {};
  const double mean_light = all_light / SumByPhase::count;
  double error_of_black = 0;
  for (std::size_t v = 0; v < target.size(); ++v) {
    TargetView& view = target[v];
    double view_light = 0;
    for (std::size_t i = 0; i < view.lights.size(); ++i) {
      TargetLight& at = view.lights[i];
      // A phase that is all but black weighs as one with a ten-thousandth of the mean light.
      const double at_phase = std::max(light(phases[v][i]), 1e-4 * mean_light);
      at.typical = at_phase / std::max(weight(phases[v][i]), 1e-30);
      at.weight /= at_phase * SumByPhase::count;
      view_light += at.weight * at.reflected.sum();
    }
    const double most = view.wo.z() < least_picture_cosine ? picture_share(view.wo.z(), views) : 1;
    for (TargetLight& at : view.lights) at.weight *= std::min(1.0, most / view_light);
    error_of_black += std::min(view_light, most);
  }
  for (TargetView& view : target) {
    for (TargetLight& at : view.lights) at.weight /= error_of_black;
  }
  std::erase_if(target, [](const TargetView& view) { return view.lights.empty(); });
  return target;
}

Target thinned(const Target& target, std::size_t view_stride, std::size_t light_stride,
               std::size_t choice) {
  const std::size_t finer =
      std::max<std::size_t>(1, (target.size() + fewest_views / 2) / fewest_views);
  view_stride *= finer;
  light_stride = std::max<std::size_t>(1, light_stride / finer);
  Target result;
  // Counts on from view to view, so that no azimuth is preferred.
  std::size_t next = choice % light_stride;
  const std::size_t stride = std::min(view_stride, target.size());
  const std::size_t first = (stride / 2 + choice * (stride / 3 + 1)) % stride;
  for (std::size_t i = first; i < target.size(); i += view_stride) {
    // Of finer views, neighbours have the other azimuths.
    const TargetView& from = target[std::min(i + result.size() % finer, target.size() - 1)];
    const std::vector<TargetLight>& lights = from.lights;
    TargetView view{from.wo, {}};
    // A view with fewer lights than are skipped keeps its last.
    for (next = std::min(next, lights.size() - 1); next < lights.size(); next += light_stride) {
      view.lights.push_back(lights[next]);
      view.lights.back().weight *= static_cast<double>(view_stride * light_stride);
    }
    next -= lights.size();
    result.push_back(std::move(view));
  }
  return result;
}

double error_of(const Target& target, const Reflectance& f_times_cosine, int threads) {
  std::vector<double> errors(target.size());
  parallel_for(static_cast<int>(target.size()), thread_count(threads), [&](int i) {
    const TargetView& view = target[static_cast<std::size_t>(i)];
    double& error = errors[static_cast<std::size_t>(i)];
    for (const TargetLight& at : view.lights) {
      error += at.weight * (f_times_cosine(at.wi, view.wo) - at.reflected).abs().sum();
    }
  });
  return std::accumulate(errors.begin(), errors.end(), 0.0);
}

}  // namespace lobefit
