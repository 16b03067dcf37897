#include "closures/closure_search.h"

#include <algorithm>
#include <iterator>

#include "closures/view_paths.h"
#include "measurement/parallel.h"

namespace lobefit {
namespace {

// |r| is rounded off below so many times what is typical, in the last two descents.
constexpr double first_smoothing = 0.01, last_smoothing = 0.002;
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
    look_for(specular);
    monitor_.report("Fitting closures", 0.5);
    follow(large_, 0.03, 10);
    for (FoundCurves& found : found_) {
      for (int i = 0; i < 3; ++i) found.closures = subdivided(found.closures);
    }
    monitor_.report("Fitting closures", 0.6);
    follow(full_, first_smoothing, 8);
    keep(2);
    monitor_.report("Fitting closures", 0.8);
    follow(full_, first_smoothing, 30);
    return refined(full_, std::move(found_.front().closures), threads_, monitor_);
  }

 private:
  // Leaves promising closures in found_, with curves of few splines. Which of many near-equal ones
  // are found depends on the choice of samples, so there are several.
  void look_for(int specular) {
    std::vector<FoundCurves> from_all;
    for (std::size_t i = 0; i < small_.size(); ++i) {
      monitor_.report("Trying closures", 0.25 * static_cast<double>(i));
      start_from(starts(small_[i], specular));
      follow(medium_, 0.1, 10);
      keep(5);
      std::move(found_.begin(), found_.end(), std::back_inserter(from_all));
    }
    found_ = std::move(from_all);
    sort();
    keep(4);
  }

  // The best ways through closures of single views, and the best of one closure less with another.
  std::vector<ClosureCurves> starts(const SearchTarget& views, int specular) {
    ViewPaths paths(views, threads_, monitor_);
    for (int k = 0; k + 1 < specular; ++k) paths.add_closure(monitor_);
    if (specular == 0) return paths.ways();
    start_from(paths.ways());
    follow(medium_, 0.1, 10);
    start_from(extended(found_.front().closures));
    follow(views, 0.3, 5);
    keep(4);
    paths.add_closure(monitor_);
    std::vector<ClosureCurves> all = paths.ways();
    for (FoundCurves& found : found_) all.push_back(std::move(found.closures));
    return all;
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

  // The best; of those that have come to the same, one.
  void keep(std::size_t most) {
    const auto alike = [](const FoundCurves& a, const FoundCurves& b) {
      return a.closures.distributions == b.closures.distributions && b.error < a.error * (1 + 1e-4);
    };
    found_.erase(std::unique(found_.begin(), found_.end(), alike), found_.end());
    found_.resize(std::min(found_.size(), most), found_.front());
  }

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
  // Few iterations: whoever limits views looks at them again and goes on.
  closures = descend(target, std::move(closures), last_smoothing, 16, monitor, threads);
  const double error = smooth_error(target, closures, judging_smoothing);
  return {std::move(closures), error};
}

}  // namespace lobefit
