#include "closures/view_paths.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "measurement/parallel.h"

namespace lobefit {
namespace {

// What a jump counts against the errors of single views: the ways differ, and which is best shows
// when curves follow them.
constexpr std::array<double, 3> reluctances = {0.05, 0.2, 0.8};
constexpr double smoothing = 0.03;
// Most starts lead to the same few optima: after the first iterations the better half goes on.
constexpr int first_iterations = 6, iterations = 8;
// Optima of a view that are told apart, and what part of the light has to be off for that.
constexpr std::size_t most_optima = 8;
constexpr double alike = 0.02;
// How many of them, the best first, are starts for one closure more, and for the angles beside.
constexpr std::size_t most_extended = 2, most_spread = 3;

double root_of(const SearchTarget& view) { return std::sqrt(view.front().wo.z()); }

}  // namespace

ViewPaths::ViewPaths(const SearchTarget& views, int threads, const Monitor& monitor)
    : threads_(threads) {
  const ClosureLayout diffuse{0};
  const ClosureCurves start{diffuse, {}, Eigen::MatrixXd::Zero(diffuse.curves(), 1)};
  OptimaByView& optima = by_distributions_[start.distributions];
  for (const SearchView& view : views) {
    views_.push_back({view});
    optima.push_back(optima_from(views_.size() - 1, {start}, monitor));
  }
}

void ViewPaths::add_closure(const Monitor& monitor) {
  std::vector<std::map<std::vector<Distribution>, std::vector<ClosureCurves>>> starts(
      views_.size());
  for (const auto& [distributions, by_view] : by_distributions_) {
    for (std::size_t view = 0; view < views_.size(); ++view) {
      for (std::size_t i = 0; i < std::min(most_extended, by_view[view].size()); ++i) {
        for (ClosureCurves& start : extended(by_view[view][i].closures)) {
          starts[view][start.distributions].push_back(std::move(start));
        }
      }
    }
  }
  by_distributions_.clear();
  std::vector<OptimaByView*> all;
  for (const auto& [distributions, of_first] : starts.front()) {
    OptimaByView& optima = by_distributions_[distributions];
    optima.resize(views_.size());
    parallel_for(static_cast<int>(views_.size()), threads_, [&, &choice = distributions](int job) {
      const auto view = static_cast<std::size_t>(job);
      optima[view] = optima_from(view, starts[view].at(choice), monitor);
    });
    all.push_back(&optima);
  }
  parallel_for(static_cast<int>(all.size()), threads_,
               [&](int job) { spread(*all[static_cast<std::size_t>(job)], monitor); });
}

// What is best at one view angle is near the best of the next, but can be far from all starts.
void ViewPaths::spread(OptimaByView& optima, const Monitor& monitor) const {
  const auto take_over = [&](std::size_t to, std::size_t from) {
    Optima both = std::move(optima[to]);
    for (std::size_t i = 0; i < std::min(most_spread, optima[from].size()); ++i) {
      both.push_back(optimum(to, optima[from][i].closures, monitor));
    }
    optima[to] = distinct(std::move(both));
  };
  for (std::size_t view = 1; view < optima.size(); ++view) take_over(view, view - 1);
  for (std::size_t view = optima.size() - 1; view-- > 0;) take_over(view, view + 1);
}

std::vector<ClosureCurves> ViewPaths::ways() const {
  std::vector<ClosureCurves> all;
  for (const auto& [distributions, optima] : by_distributions_) {
    for (ClosureCurves& closures : ways(optima)) all.push_back(std::move(closures));
  }
  return all;
}

ViewPaths::Optima ViewPaths::optima_from(std::size_t view, const std::vector<ClosureCurves>& starts,
                                         const Monitor& monitor) const {
  std::vector<std::pair<double, ClosureCurves>> begun;
  for (const ClosureCurves& start : starts) {
    ClosureCurves closures = descend(views_[view], start, smoothing, first_iterations, monitor);
    const double error = smooth_error(views_[view], closures, smoothing);
    begun.emplace_back(error, std::move(closures));
  }
  std::stable_sort(begun.begin(), begun.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  begun.resize((begun.size() + 1) / 2, begun.front());
  Optima found;
  for (const auto& [error, closures] : begun) found.push_back(optimum(view, closures, monitor));
  return distinct(std::move(found));
}

ViewPaths::Optimum ViewPaths::optimum(std::size_t view, const ClosureCurves& start,
                                      const Monitor& monitor) const {
  const SearchTarget& target = views_[view];
  const ClosureCurves closures = descend(target, start, smoothing, iterations, monitor);
  Optimum result{closures,
                 smooth_error(target, closures, 1e-3),
                 light_of_closures(target.front(), closures),
                 {}};
  for (int k = 0; k < closures.layout.specular; ++k) {
    result.shapes.push_back(shape_at(closures, k, target.front().wo.z()));
  }
  return result;
}

// What closures are off half-way between two optima: about as large a part of their light as the
// logarithms of their widths differ by and as they are moved in their own width.
double ViewPaths::jump(const Optimum& from, const Optimum& to) {
  double sum = 0;
  for (std::size_t k = 0; k < from.shapes.size(); ++k) {
    const Shape &a = from.shapes[k], &b = to.shapes[k];
    const double width = std::exp((a.log_alpha_x + b.log_alpha_x) / 2);
    const double off = std::abs(a.log_alpha_x - b.log_alpha_x) +
                       std::abs(a.log_alpha_y - b.log_alpha_y) + std::abs(a.tilt - b.tilt) / width;
    const auto closure = static_cast<Eigen::Index>(k);
    sum += std::sqrt(from.light[closure] * to.light[closure]) * std::min(off, 1.0);
  }
  return sum;
}

// The best of the optima that are not alike.
ViewPaths::Optima ViewPaths::distinct(Optima optima) {
  std::stable_sort(optima.begin(), optima.end(),
                   [](const Optimum& a, const Optimum& b) { return a.error < b.error; });
  Optima kept;
  for (const Optimum& next : optima) {
    const bool known = std::any_of(kept.begin(), kept.end(), [&](const Optimum& other) {
      return jump(other, next) <= alike * next.light.sum();
    });
    if (!known) kept.push_back(next);
    if (kept.size() == most_optima) break;
  }
  return kept;
}

// Closures of one distribution can take each other's places.
ViewPaths::Optima ViewPaths::in_every_order(const Optimum& optimum) {
  const ClosureLayout& layout = optimum.closures.layout;
  const auto& distributions = optimum.closures.distributions;
  std::vector<std::size_t> order(distributions.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  Optima all;
  do {
    const bool fits = std::equal(
        order.begin(), order.end(), distributions.begin(),
        [&](std::size_t k, Distribution distribution) { return distributions[k] == distribution; });
    if (!fits) continue;
    Optimum ordered = optimum;
    for (std::size_t k = 0; k < order.size(); ++k) {
      const int to = static_cast<int>(k), from = static_cast<int>(order[k]);
      const auto move = [&](int to_curve, int from_curve) {
        ordered.closures.x.middleRows<3>(to_curve) = optimum.closures.x.middleRows<3>(from_curve);
      };
      move(layout.shape(to, 0), layout.shape(from, 0));
      move(layout.weight(to, 0), layout.weight(from, 0));
      ordered.light[to] = optimum.light[from];
      ordered.shapes[k] = optimum.shapes[order[k]];
    }
    all.push_back(std::move(ordered));
  } while (std::next_permutation(order.begin(), order.end()));
  return all;
}

std::vector<ClosureCurves> ViewPaths::ways(const OptimaByView& optima) const {
  OptimaByView ordered(optima.size());
  for (std::size_t view = 0; view < optima.size(); ++view) {
    for (const Optimum& each : optima[view]) {
      for (Optimum& order : in_every_order(each)) ordered[view].push_back(std::move(order));
    }
  }
  std::vector<Path> found;
  for (const double reluctance : reluctances) {
    Path path = way(ordered, reluctance);
    if (std::find(found.begin(), found.end(), path) == found.end()) found.push_back(path);
  }
  std::vector<ClosureCurves> result;
  result.reserve(found.size());
  for (const Path& path : found) result.push_back(through(path));
  return result;
}

ViewPaths::Path ViewPaths::way(const OptimaByView& optima, double reluctance) const {
  // The least cost of a way to each optimum of a view, and the optimum before it on that way.
  std::vector<std::vector<double>> cost(optima.size());
  std::vector<std::vector<std::size_t>> before(optima.size());
  for (std::size_t view = 0; view < optima.size(); ++view) {
    for (const Optimum& here : optima[view]) {
      double least = view == 0 ? 0 : std::numeric_limits<double>::infinity();
      std::size_t from = 0;
      for (std::size_t i = 0; view > 0 && i < cost[view - 1].size(); ++i) {
        const double by_it = cost[view - 1][i] + reluctance * jump(optima[view - 1][i], here);
        if (by_it < least) {
          least = by_it;
          from = i;
        }
      }
      cost[view].push_back(least + here.error);
      before[view].push_back(from);
    }
  }
  const std::vector<double>& last = cost.back();
  auto at = static_cast<std::size_t>(std::min_element(last.begin(), last.end()) - last.begin());
  Path path(optima.size());
  for (std::size_t view = optima.size(); view-- > 0;) {
    path[view] = &optima[view][at];
    at = before[view][at];
  }
  return path;
}

ClosureCurves ViewPaths::through(const Path& path) const {
  constexpr int coefficients = ViewSplines::coarse;
  const ClosureCurves& first = path.front()->closures;
  ClosureCurves closures{first.layout, first.distributions,
                         Eigen::MatrixXd(first.x.rows(), coefficients)};
  for (int i = 0; i < coefficients; ++i) {
    // Views ascend. Between two of them values go straight from one to the other.
    const double root = ViewSplines::centre(i, coefficients);
    std::size_t next = 0;
    while (next + 1 < path.size() && root_of(views_[next]) < root) ++next;
    const std::size_t last = next == 0 ? 0 : next - 1;
    const double gap = root_of(views_[next]) - root_of(views_[last]);
    const double share = gap > 0 ? std::clamp((root - root_of(views_[last])) / gap, 0.0, 1.0) : 0.0;
    closures.x.col(i) = (1 - share) * path[last]->closures.x + share * path[next]->closures.x;
  }
  return closures;
}

}  // namespace lobefit
