#include "closures/fit_closures.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "closures/closure_search.h"
#include "measurement/parallel.h"

namespace lobefit {
namespace {

// How far curve nodes may be off the curves that were fitted, as a part of what they stand for: so
// little that the error does not show it.
double curve_tolerance(double error) { return std::clamp(0.01 * error, 1e-4, 2e-3); }

double least_over_view(const std::function<double(double)>& of_cosine) {
  double least = of_cosine(1);
  for (int i = 0; i < 32; ++i) least = std::min(least, of_cosine(i / 32.0));
  return least;
}

// By how much the weights of a channel are lowered at each view angle of the target.
struct WeightFactors {
  std::array<ViewCurve, 3> by_channel = {ViewCurve(1), ViewCurve(1), ViewCurve(1)};
};

ClosureSet to_closures(const ClosureCurves& curves, double tolerance,
                       const WeightFactors& factors) {
  const ClosureLayout& layout = curves.layout;
  const auto weight_of = [&](int closure, int channel) {
    const int curve = layout.weight(closure, channel);
    const double size = curves.x.row(curve).maxCoeff();
    const ViewCurve& factor = factors.by_channel[static_cast<std::size_t>(channel)];
    return ViewCurve::following(
        [&](double cosine) { return factor(cosine) * curves.at(curve, cosine); }, tolerance * size);
  };
  ClosureSet result;
  for (int c = 0; c < 3; ++c) {
    result.diffuse[static_cast<std::size_t>(c)] = weight_of(layout.specular, c);
  }
  for (int k = 0; k < layout.specular; ++k) {
    const auto sockets = [&](double ClosureSockets::*socket) {
      return [&, k, socket](double cosine) {
        const double inside = std::clamp(cosine, 1e-3, 1 - 1e-6);
        const Vector3 wo(std::sqrt(1 - square(inside)), 0, inside);
        return to_sockets(shape_at(curves, k, inside), wo).*socket;
      };
    };
    SpecularClosure closure;
    closure.distribution = curves.distributions[static_cast<std::size_t>(k)];
    // A highlight moved by a part of its width changes as much as one that is wider by that part.
    const double least_roughness = least_over_view(sockets(&ClosureSockets::roughness));
    closure.roughness =
        ViewCurve::following(sockets(&ClosureSockets::roughness), tolerance * least_roughness);
    closure.anisotropy = ViewCurve::following(sockets(&ClosureSockets::anisotropy), 4 * tolerance);
    closure.bend = ViewCurve::following(sockets(&ClosureSockets::bend),
                                        4 * tolerance * square(least_roughness));
    for (int c = 0; c < 3; ++c) closure.weight[static_cast<std::size_t>(c)] = weight_of(k, c);
    result.specular.push_back(std::move(closure));
  }
  return result;
}

std::vector<SeenAtAngle> look_at(const Target& target, const ClosureSet& closures) {
  std::vector<SeenAtAngle> seen;
  for (const TargetView& view : target) {
    SeenAtAngle at{view.wo.z(), Rgb::Zero(), Rgb::Zero(), 0};
    const ClosuresAtView seen_closures(closures, view.wo);
    double error = 0, light = 0;
    for (const TargetLight& to : view.lights) {
      const Rgb reflected = seen_closures.evaluate(to.wi, to.half);
      at.target_albedo += to.solid_angle * to.reflected;
      at.closures_albedo += to.solid_angle * reflected;
      error += to.weight * (reflected - to.reflected).abs().sum();
      light += to.weight * to.reflected.sum();
    }
    at.relative_error = light > 0 ? error / light : 0;
    seen.push_back(at);
  }
  return seen;
}

// What closures may reflect of a white world: a little more than the target does.
Rgb most_albedo(const SeenAtAngle& at) { return 1.01 * at.target_albedo; }

// Closures that are bent less where a white world would show too much of them, and reflect less
// where they would reflect too much, unless that costs more than a fifth of their error.
FoundCurves within_limits(const Target& target, const FoundCurves& found, int threads,
                          const Monitor& monitor) {
  constexpr double most_cost = 1.2;
  // Views are watched from a part of their limits on, and are over them by more than a part.
  constexpr double watched = 0.7, over = 1.05, watched_albedo = 0.99, over_albedo = 1.005;
  SearchTarget views = in_columns(target);
  FoundCurves limited = found;
  // Views that were within their limits may come to be over them; and a descent that stopped at the
  // edge of new limits goes on when it is begun again.
  for (int round = 0; round < 4; ++round) {
    const std::vector<SeenAtAngle> seen = look_at(
        target, to_closures(limited.closures, curve_tolerance(limited.error), WeightFactors()));
    bool exceeded = false;
    for (std::size_t i = 0; i < views.size(); ++i) {
      std::optional<ViewLimits>& limits = views[i].limits;
      const Rgb& albedo = seen[i].closures_albedo;
      const Rgb most = most_albedo(seen[i]);
      const double excess = world_excess(limited.closures, views[i].wo).maxCoeff() /
                            (albedo.maxCoeff() * most_excess(seen[i].cosine));
      // Closures go on to reflect a little more than they may where that is worth it.
      const bool reflects_more = !limits && (albedo > over_albedo * most).any();
      exceeded = exceeded || excess > over || reflects_more;
      if (excess > watched || (albedo > watched_albedo * most).any()) {
        limits = {albedo.maxCoeff(), most, excess > watched || (limits && limits->excess)};
      }
    }
    if (!exceeded && round != 1) break;
    limited = refined(views, std::move(limited.closures), threads, monitor);
  }
  return limited.error < most_cost * found.error ? limited : found;
}

// Where closures reflect more than they may, the factors that mend it.
WeightFactors energy_factors(const std::vector<SeenAtAngle>& seen, bool cap_albedo) {
  WeightFactors factors;
  for (std::size_t c = 0; c < 3; ++c) {
    const auto channel = static_cast<Eigen::Index>(c);
    std::vector<ViewCurve::Point> points;
    for (const SeenAtAngle& at : seen) {
      double most = most_albedo(at)[channel];
      if (cap_albedo) most = std::min(most, 1.0);
      const double now = at.closures_albedo[channel];
      points.push_back({at.cosine, now > most ? most / now : 1});
    }
    factors.by_channel[c] = ViewCurve(std::move(points));
  }
  return factors;
}

double error_of_closures(const Target& target, const ClosureSet& closures) {
  double error = 0;
  for (const TargetView& view : target) {
    const ClosuresAtView at(closures, view.wo);
    for (const TargetLight& light : view.lights) {
      error += light.weight * (at.evaluate(light.wi, light.half) - light.reflected).abs().sum();
    }
  }
  return error;
}

// Leaves out what the error does not miss: each closure in turn, and the colour of a weight that is
// all but grey.
void leave_out(const Target& target, FittedClosures& fitted) {
  const double missed = 0.005 * fitted.error;
  const auto adopt = [&](const ClosureSet& tried) {
    const double error = error_of_closures(target, tried);
    if (!(error < fitted.error + missed)) return false;
    fitted.closures = tried;
    fitted.error = error;
    return true;
  };
  ClosureSet without_diffuse = fitted.closures;
  without_diffuse.diffuse = {};
  adopt(without_diffuse);
  for (std::size_t k = 0; k < fitted.closures.specular.size();) {
    ClosureSet without = fitted.closures;
    without.specular.erase(without.specular.begin() + static_cast<std::ptrdiff_t>(k));
    if (!adopt(without)) ++k;
  }
  const auto try_grey = [&](auto&& weight_in) {
    ClosureSet grey = fitted.closures;
    RgbCurve& weight = weight_in(grey);
    weight[0] = weight[2] = weight[1];
    adopt(grey);
  };
  try_grey([](ClosureSet& set) -> RgbCurve& { return set.diffuse; });
  for (std::size_t k = 0; k < fitted.closures.specular.size(); ++k) {
    try_grey([k](ClosureSet& set) -> RgbCurve& { return set.specular[k].weight; });
  }
}

}  // namespace

FittedClosures fit_closures(const Target& target, const ClosureFitOptions& options,
                            Monitor& monitor) {
  if (target.empty()) return {};
  const int threads = thread_count(options.threads);
  const FoundCurves best = within_limits(
      target, search_curves(target, options.specular, threads, monitor), threads, monitor);
  const double tolerance = curve_tolerance(best.error);
  WeightFactors factors;
  FittedClosures result{to_closures(best.closures, tolerance, factors), 0, {}};
  factors = energy_factors(look_at(target, result.closures), options.cap_albedo);
  result.closures = to_closures(best.closures, tolerance, factors);
  result.error = error_of_closures(target, result.closures);
  leave_out(target, result);
  result.by_view = look_at(target, result.closures);
  // Of a target that is all but black, Cycles drops closures that the fit relies on: fewer of more
  // weight may then be nearer.
  if (options.specular > 0 && result.error > 1.5 * best.error) {
    ClosureFitOptions fewer = options;
    --fewer.specular;
    FittedClosures other = fit_closures(target, fewer, monitor);
    if (other.error < result.error) return other;
  }
  return result;
}

FittedClosures fit_closures_within(const Target& target, double tolerance,
                                   ClosureFitOptions options, Monitor& monitor) {
  FittedClosures best;
  for (options.specular = 0; options.specular <= most_specular_closures; ++options.specular) {
    FittedClosures fitted = fit_closures(target, options, monitor);
    if (options.specular == 0 || fitted.error < best.error) best = std::move(fitted);
    if (best.error <= tolerance) break;
  }
  return best;
}

}  // namespace lobefit
