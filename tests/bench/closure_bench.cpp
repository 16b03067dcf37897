// The search for closures: ./dev bench closure_bench FILE..
//
// For each measured file, for the lobe that is fitted to it, and for 1, 2 and 3 specular closures:
// error, least seconds of three searches on every processor beside the seconds of sampling, and the
// number of points of all curves. The last columns are bounds for 2 and 3: the sum of the errors of
// closures that are fitted to every third view angle alone, counted thrice, without smooth curves
// between them: with the distributions that are best for all angles together, as in a material, and
// with the best for each. No material made of a diffuse and so many such closures can be much
// nearer than that.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

#include "closures/closure_search.h"
#include "closures/fit_closures.h"
#include "fitting/fit.h"
#include "measurement/parallel.h"
#include "measurement/read_measurement.h"

namespace lobefit {
namespace {

template <typename Work>
double seconds_of(Work&& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

std::size_t points_of(const ClosureSet& closures) {
  std::size_t points = 0;
  const auto add = [&](const ViewCurve& curve) { points += curve.points().size(); };
  for (const ViewCurve& curve : closures.diffuse) add(curve);
  for (const SpecularClosure& specular : closures.specular) {
    add(specular.roughness);
    add(specular.anisotropy);
    add(specular.bend);
    for (const ViewCurve& curve : specular.weight) add(curve);
  }
  return points;
}

// The best closures of some view angles, each fitted by itself: from random starts, then from what
// is best at the angles beside, as long as anything is gained.
class FreeClosures {
 public:
  FreeClosures(const Target& target, int specular) : specular_(specular) {
    for (std::size_t view = view_stride / 2; view < target.size(); view += view_stride) {
      views_.push_back(in_columns({target[view]}));
    }
    for (int beckmanns = 0; beckmanns <= specular; ++beckmanns) {
      all_.push_back(best_of_views(beckmanns));
    }
  }

  // Sums over all angles, the distributions the same at each or not.
  double of_one_choice() const {
    double least = 1e9;
    for (const Choice& choice : all_) least = std::min(least, sum(choice));
    return least;
  }
  double of_any() const {
    Choice least = all_.front();
    for (const Choice& choice : all_) {
      for (std::size_t view = 0; view < least.size(); ++view) {
        if (choice[view].error < least[view].error) least[view] = choice[view];
      }
    }
    return sum(least);
  }

 private:
  using Choice = std::vector<FoundCurves>;  // the best of each view
  static constexpr std::size_t view_stride = 3;
  static constexpr int random_starts = 100, sweeps = 10;

  static double sum(const Choice& choice) {
    double sum = 0;
    for (const FoundCurves& found : choice) sum += found.error;
    return sum * static_cast<double>(view_stride);
  }

  Choice best_of_views(int beckmanns) const {
    Choice best(views_.size());
    parallel_for(static_cast<int>(views_.size()), thread_count(0), [&](int job) {
      const auto view = static_cast<std::size_t>(job);
      std::mt19937 random(static_cast<unsigned>(job));
      for (int i = 0; i < random_starts; ++i) {
        improve(view, drawn_start(views_[view].front(), beckmanns, random), best[view]);
      }
    });
    double before = 2 * sum(best);
    for (int sweep = 0; sweep < sweeps && sum(best) < 0.9999 * before; ++sweep) {
      before = sum(best);
      for (std::size_t i = 1; i < best.size(); ++i) improve(i, best[i - 1].closures, best[i]);
      for (std::size_t i = best.size() - 1; i-- > 0;) improve(i, best[i + 1].closures, best[i]);
    }
    return best;
  }

  ClosureCurves drawn_start(const SearchView& view, int beckmanns, std::mt19937& random) const {
    const ClosureLayout layout{specular_};
    std::vector<Distribution> distributions(static_cast<std::size_t>(specular_), Distribution::ggx);
    std::fill_n(distributions.begin(), beckmanns, Distribution::beckmann);
    ClosureCurves start{layout, distributions, Eigen::MatrixXd::Zero(layout.curves(), 1)};
    std::uniform_real_distribution<double> one(0, 1), either(-1, 1);
    for (int k = 0; k < specular_; ++k) {
      start.x(layout.shape(k, ClosureLayout::mean)) = std::log(0.008) * one(random);
      start.x(layout.shape(k, ClosureLayout::spread)) = either(random);
      start.x(layout.shape(k, ClosureLayout::bend)) =
          0.6 * either(random) / std::max(view.angle.sine, 0.2);
    }
    start.x.bottomRows(3 * layout.closures()).setConstant(0.1 * one(random));
    return start;
  }

  // Keeps what is found from the start, if it is better.
  void improve(std::size_t view, ClosureCurves closures, FoundCurves& best) const {
    const Monitor monitor;
    for (const double smoothing : {0.3, 0.03, 0.01, 0.002}) {
      closures = descend(views_[view], std::move(closures), smoothing, 20, monitor);
    }
    const double error = smooth_error(views_[view], closures, 1e-7);  // not rounded off
    if (best.closures.distributions.empty() || error < best.error) best = {closures, error};
  }

  const int specular_;
  std::vector<SearchTarget> views_;  // each of one view
  std::vector<Choice> all_;          // for every number of Beckmann closures
};

void tell(const std::string& name, const Reflectance& f) {
  Target target;
  const double sample = seconds_of([&] { target = sample_target(f); });
  std::printf("| %s | %.3f |", name.c_str(), sample);
  for (int count = 1; count <= most_specular_closures; ++count) {
    FittedClosures fitted;
    double least = 1e9;
    for (int round = 0; round < 3; ++round) {
      Monitor monitor;
      const ClosureFitOptions options{count, false, 0};
      least = std::min(least, seconds_of([&] { fitted = fit_closures(target, options, monitor); }));
    }
    std::printf(" %.4f, %.2f s, %zu |", fitted.error, least, points_of(fitted.closures));
  }
  for (const int count : {2, 3}) {
    const FreeClosures free(target, count);
    std::printf(" %.4f, %.4f |", free.of_one_choice(), free.of_any());
  }
  std::printf("\n");
  std::fflush(stdout);
}

void tell(const std::string& path) {
  const Measurement measurement = read_measurement(path);
  tell(path, [&](const Vector3& wi, const Vector3& wo) { return measurement.evaluate(wi, wo); });
  FitOptions options;
  options.norm = Norm::cosine_l1;
  Monitor monitor;
  const Parameters lobe = fit_model(measurement, options, monitor).parameters;
  tell(path + ", its lobe",
       [&](const Vector3& wi, const Vector3& wo) { return evaluate_model(lobe, wi, wo); });
}

}  // namespace
}  // namespace lobefit

int main(int count, char** paths) {
  std::printf("| target | sample s | 1: error, s, points | 2 | 3 |");
  std::printf(" bound of 2: one choice, any | of 3 |\n");
  std::printf("|---|---|---|---|---|---|---|\n");
  for (int i = 1; i < count; ++i) lobefit::tell(paths[i]);
}
