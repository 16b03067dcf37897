#include "closures/closure_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "closures/view_paths.h"
#include "measurement/parallel.h"

namespace lobefit {
namespace {

using enum ClosureLayout::ShapeCurve;
using enum Distribution;
using Distributions = std::vector<Distribution>;

constexpr std::array<double, 6> start_alphas = {0.008, 0.025, 0.07, 0.17, 0.4, 0.9};
// The best two closures for a lobe that is nearly diffuse are bent apart.
constexpr std::array<double, 2> start_bends = {0.3, 0.8};
constexpr double least_bent_alpha = 0.1;
constexpr double start_weight = 0.1;

// Closures with the same curves at all view angles.
ClosureCurves constant_start(const Distributions& distributions, const std::vector<double>& alphas,
                             int bent, double bend_of_it) {
  const ClosureLayout layout{static_cast<int>(distributions.size())};
  Eigen::VectorXd x = Eigen::VectorXd::Zero(layout.curves());
  for (int k = 0; k < layout.specular; ++k) {
    x[layout.shape(k, mean)] = std::log(alphas[static_cast<std::size_t>(k)]);
    x[layout.shape(k, bend)] = k == bent ? bend_of_it : 0;
  }
  x.tail(layout.closures() * 3).setConstant(start_weight);
  return {layout, distributions, x};
}

// Beckmann closures first, every number of them.
std::vector<Distributions> choices(int specular) {
  std::vector<Distributions> all;
  for (int beckmanns = 0; beckmanns <= specular; ++beckmanns) {
    Distributions chosen(static_cast<std::size_t>(specular), ggx);
    std::fill_n(chosen.begin(), beckmanns, beckmann);
    all.push_back(std::move(chosen));
  }
  return all;
}

// Adds a start for every rising choice of the widths from `first` on.
void add_starts(const Distributions& distributions, std::vector<double>& alphas, std::size_t first,
                std::vector<ClosureCurves>& starts) {
  if (alphas.size() < distributions.size()) {
    for (std::size_t i = first; i < start_alphas.size(); ++i) {
      alphas.push_back(start_alphas[i]);
      add_starts(distributions, alphas, i + 1, starts);
      alphas.pop_back();
    }
    return;
  }
  starts.push_back(constant_start(distributions, alphas, -1, 0));
  if (distributions != Distributions{beckmann, beckmann} || alphas[0] < least_bent_alpha) return;
  for (const double bend : start_bends) {
    for (const int bent : {0, 1}) {
      starts.push_back(constant_start(distributions, alphas, bent, bend));
    }
  }
}

std::vector<ClosureCurves> constant_starts(int specular) {
  std::vector<ClosureCurves> starts;
  for (const Distributions& distributions : choices(specular)) {
    std::vector<double> alphas;
    add_starts(distributions, alphas, 0, starts);
  }
  return starts;
}

ClosureCurves with_splines(const ClosureCurves& constant) {
  return {constant.layout, constant.distributions, constant.x.replicate(1, ViewSplines::coarse)};
}

// The closures with one more, of any width and all but black: so they can only become better.
std::vector<ClosureCurves> extended(const ClosureCurves& closures) {
  const ClosureLayout& from = closures.layout;
  const ClosureLayout to{from.specular + 1};
  std::vector<ClosureCurves> all;
  for (const double alpha : start_alphas) {
    for (const auto distribution : {ggx, beckmann}) {
      ClosureCurves more{to, closures.distributions,
                         Eigen::MatrixXd::Zero(to.curves(), closures.coefficients())};
      more.distributions.push_back(distribution);
      const auto copy = [&](int to_curve, int from_curve, int curves) {
        more.x.middleRows(to_curve, curves) = closures.x.middleRows(from_curve, curves);
      };
      copy(0, 0, from.specular * shape_curves);
      more.x.row(to.shape(from.specular, mean)).setConstant(std::log(alpha));
      for (int k = 0; k < from.specular; ++k) copy(to.weight(k, 0), from.weight(k, 0), 3);
      more.x.middleRows(to.weight(from.specular, 0), 3).setConstant(1e-3);
      copy(to.weight(to.specular, 0), from.weight(from.specular, 0), 3);
      all.push_back(std::move(more));
    }
  }
  return all;
}

// How many of what was found with few splines go on with many.
constexpr std::size_t promising = 2;
// |r| is rounded off below so many times what is typical, in the last descents.
constexpr std::array<double, 2> last_smoothings = {0.01, 0.002};
constexpr int last_iterations = 30;
// Of the error that tells which closures are better.
constexpr double judging_smoothing = 1e-3;

class Search {
 public:
  Search(const Target& target, int threads, Monitor& monitor)
      : full_(in_columns(target)),
        large_(in_columns(thinned(target, 1, 2))),
        medium_(in_columns(thinned(target, 6, 2))),
        small_{in_columns(thinned(target, 9, 5, 0)), in_columns(thinned(target, 9, 5, 1))},
        threads_(threads),
        monitor_(monitor) {}

  FoundCurves run(int specular) {
    std::vector<ClosureCurves> starts;
    if (specular == most_specular_closures) {
      look_for(specular - 1, {}, 1, 0, 0.2);
      starts = extended(found_.front().closures);
    }
    const double begun = starts.empty() ? 0 : 0.2;
    const std::vector<ViewPaths> paths =
        look_for(specular, std::move(starts), small_.size(), begun, 0.5);
    monitor_.report("Fitting closures", 0.5);
    follow(large_, 0.03, 20);
    keep(promising);
    for (int round = 0; round < 2 && take_detour(paths); ++round) continue;
    monitor_.report("Fitting closures", 0.8);
    for (FoundCurves& found : found_) {
      for (int i = 0; i < 3; ++i) found.closures = subdivided(found.closures);
    }
    for (const double smoothing : last_smoothings) follow(full_, smoothing, last_iterations);
    return found_.front();
  }

 private:
  // Leaves promising closures in found_, with curves of few splines, some after these starts. Which
  // of many near-equal ones are found depends on the choice of samples, so there are several.
  std::vector<ViewPaths> look_for(int specular, std::vector<ClosureCurves> starts,
                                  std::size_t thinnings, double progress, double progress_end) {
    const std::vector<ClosureCurves> constant = constant_starts(specular);
    if (starts.empty()) {
      for (const ClosureCurves& start : constant) starts.push_back(with_splines(start));
    }
    std::vector<FoundCurves> from_all;
    std::vector<ViewPaths> paths;
    for (std::size_t i = 0; i < thinnings; ++i) {
      const SearchTarget& small = small_[i];
      const double share = static_cast<double>(i) / static_cast<double>(thinnings);
      monitor_.report("Trying closures", progress + share * (progress_end - progress));
      paths.emplace_back(small, constant, threads_, monitor_);
      start_from(starts);
      follow(small, 0.3, 5);
      keep(10);
      for (ClosureCurves& path : paths.back().paths()) found_.push_back({std::move(path), 0});
      follow(medium_, 0.1, 10);
      keep(5);
      std::move(found_.begin(), found_.end(), std::back_inserter(from_all));
    }
    found_ = std::move(from_all);
    sort();
    keep(4);
    return paths;
  }

  // Whether a way past the best closures leads to better ones; then those are the first.
  bool take_detour(const std::vector<ViewPaths>& paths) {
    const FoundCurves best = found_.front();
    std::vector<ClosureCurves> detours;
    for (const ViewPaths& known : paths) {
      for (ClosureCurves& detour : known.detours(best.closures, monitor_)) {
        detours.push_back(std::move(detour));
      }
    }
    start_from(detours);
    follow(medium_, 0.1, 10);
    keep(2);
    follow(large_, 0.03, 20);
    const bool better = found_.front().error < best.error;
    found_.insert(better ? found_.begin() + 1 : found_.begin(), best);
    keep(promising);
    return better;
  }

  void start_from(const std::vector<ClosureCurves>& starts) {
    found_.clear();
    for (const ClosureCurves& start : starts) found_.push_back({start, 0});
  }

  // Goes on with all that was found, and sorts it by its error.
  void follow(const SearchTarget& target, double smoothing, int iterations) {
    parallel_for(static_cast<int>(found_.size()), threads_, [&](int i) {
      FoundCurves& found = found_[static_cast<std::size_t>(i)];
      found.closures = descend(target, std::move(found.closures), smoothing, iterations, monitor_);
      found.error = smooth_error(target, found.closures, judging_smoothing);
    });
    sort();
  }

  void sort() {
    std::stable_sort(found_.begin(), found_.end(),
                     [](const FoundCurves& a, const FoundCurves& b) { return a.error < b.error; });
  }

  void keep(std::size_t most) { found_.resize(std::min(found_.size(), most), found_.front()); }

  const SearchTarget full_, large_, medium_;
  const std::vector<SearchTarget> small_;
  const int threads_;
  Monitor& monitor_;
  std::vector<FoundCurves> found_;
};

}  // namespace

FoundCurves search_curves(const Target& target, int specular, int threads, Monitor& monitor) {
  return Search(target, threads, monitor).run(specular);
}

FoundCurves refined(const SearchTarget& target, ClosureCurves closures, int threads,
                    const Monitor& monitor) {
  closures = descend(target, std::move(closures), last_smoothings.back(), last_iterations, monitor,
                     threads);
  const double error = smooth_error(target, closures, judging_smoothing);
  return {std::move(closures), error};
}

}  // namespace lobefit
