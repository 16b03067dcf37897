#include "fitting/samples.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "measurement/large_pages.h"
#include "measurement/parallel.h"
#include "reflectance/model.h"

namespace lobefit {
namespace {

constexpr int folded_phi_bins = Measurement::folded_phi_bins;

// Values of more units than this are no lobe's but damage, and are cut: in single precision their
// squares, and the sums of these, stay finite.
constexpr double most_units = 1e15;

// The value that a share of them is below; reorders them.
double quantile(std::vector<double>& values, double share) {
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size()));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// The unit of the values: the median of the valid ones of all channels, found from one in `stride`,
// which tell it well enough. Where it is next to nothing beside the brightest (a lobe on black) it
// is their mean, to which a few damaged bins add little; of an all-zero table it is 1.
double typical_reflectance(const Measurement& measurement, std::size_t stride = 61) {
  constexpr std::size_t enough = 1000;
  constexpr double next_to_nothing = 1e-12;
  const auto planes = measurement.planes();
  std::vector<double> values;
  for (std::size_t i = 0; i < planes.size(); i += stride) {
    if (!std::isnan(planes[i])) values.push_back(planes[i]);
  }
  const auto look_at_all = [&] { return typical_reflectance(measurement, 1); };
  if (values.size() < enough && stride > 1) return look_at_all();
  if (values.empty()) return 1;
  const double bright = quantile(values, 0.999), median = quantile(values, 0.5);
  if (median > next_to_nothing * bright) return median;
  const auto lit = std::count_if(values.begin(), values.end(), [](double f) { return f > 0; });
  if (lit < static_cast<std::ptrdiff_t>(enough) && stride > 1) return look_at_all();
  double mean = 0;
  for (const double value : values) {
    mean += std::min(value, bright / next_to_nothing) / static_cast<double>(values.size());
  }
  return mean > 0 ? mean : 1;
}

// Calls visit(column) for every column; columns differ in type.
template <typename Visit>
void for_each_column(Samples& s, const Visit& visit) {
  visit(s.u_phong);
  visit(s.u_blinn);
  visit(s.weight);
  for (auto& channel : s.measured) {
    for (auto& half : channel) visit(half);
  }
}

void append(Samples& to, const Samples& from, std::size_t i) {
  to.u_phong.push_back(from.u_phong[i]);
  to.u_blinn.push_back(from.u_blinn[i]);
  to.weight.push_back(from.weight[i]);
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t half = 0; half < 2; ++half) {
      to.measured[c][half].push_back(from.measured[c][half][i]);
    }
  }
}

void begin_run(Samples& samples, double cos_theta_d) {
  samples.runs.push_back({samples.size(), samples.size(), cos_theta_d});
}

void end_run(Samples& samples) {
  const std::size_t padded =
      (samples.size() + Samples::padding - 1) / Samples::padding * Samples::padding;
  for_each_column(samples, [padded](auto& column) { column.resize(padded, 0); });
  samples.runs.back().end = padded;
  if (samples.runs.back().begin == padded) samples.runs.pop_back();
}

// Fills the run of each theta_d. Its samples are all bins above the horizon and within max_angle,
// found by geometry alone, so that every run has its place before any is filled; invalid ones have
// the weight 0.
class Builder {
 public:
  Builder(const Measurement& measurement, const FitOptions& options)
      : measurement_(measurement),
        norm_(options.norm),
        threads_(thread_count(options.threads)),
        min_cosine_(std::cos(radians(std::min(options.max_angle_degrees, 90.0)))) {
    samples_.unit = typical_reflectance(measurement);
  }

  Samples build() {
    std::size_t size = 0;
    for (int d = 0; d < Measurement::theta_d_bins; ++d) {
      Samples::Run run{size, size, t_.cos_d[d]};
      for (int h = 0; h < Measurement::theta_h_bins; ++h) {
        run.end += static_cast<std::size_t>(folded_phi_bins - first_phi(h, d));
      }
      if (run.end == run.begin) continue;
      run.end = (run.end + Samples::padding - 1) / Samples::padding * Samples::padding;
      size = run.end;
      samples_.runs.push_back(run);
      theta_d_.push_back(d);
    }
    for_each_column(samples_, [size](auto& column) {
      column.resize(size);
      ask_for_large_pages(column.data(), size * sizeof(column[0]));
    });
    parallel_for(static_cast<int>(samples_.runs.size()), threads_, [&](int r) { fill_run(r); });
    return std::move(samples_);
  }

 private:
  // The first phi_d of folded ones above the horizon: those after it stand higher.
  int first_phi(int h, int d) const {
    const double along = t_.cos_h[h] * t_.cos_d[d], across = t_.sin_h[h] * t_.sin_d[d];
    int p = 0;
    while (p < folded_phi_bins && along - across * t_.cos_phi[p] <= min_cosine_) ++p;
    return p;
  }

  void fill_run(int r) {
    const int d = theta_d_[static_cast<std::size_t>(r)];
    std::size_t at = samples_.runs[static_cast<std::size_t>(r)].begin;
    for (int h = 0; h < Measurement::theta_h_bins; ++h) {
      const int first = first_phi(h, d);
      fill_row(h, d, first, at);
      at += static_cast<std::size_t>(folded_phi_bins - first);
    }
    for (; at < samples_.runs[static_cast<std::size_t>(r)].end; ++at) leave_empty(at);
  }

  // A sample without a value.
  void leave_empty(std::size_t at) {
    for_each_column(samples_, [at](auto& column) { column[at] = 0; });
  }

  // The samples of one theta_h and theta_d, written from `at` on.
  void fill_row(int h, int d, int first, std::size_t at) {
    const double along = t_.cos_h[h] * t_.cos_d[d], across = t_.sin_h[h] * t_.sin_d[d];
    // To a mean near 1 with both cosines.
    const double scale = 32.0 / Measurement::theta_h_bins * t_.solid_angle(h, d);
    const double* const values = measurement_.planes().data() + Measurement::index(h, d, 0);
    for (int p = first; p < folded_phi_bins; ++p, ++at) {
      const int mirrored = Measurement::phi_d_bins - 1 - p;
      const bool here = !std::isnan(values[p]), there = !std::isnan(values[mirrored]);
      if (!here && !there) {
        leave_empty(at);
        continue;
      }
      const LobeCoordinates lobe =
          lobe_coordinates(t_.sin_h[h], t_.cos_h[h], t_.cos_d[d], t_.sin_d[d] * t_.cos_phi[p]);
      samples_.u_phong[at] = lobe.u_phong;
      samples_.u_blinn[at] = lobe.u_blinn;
      double weight = here && there ? 1 : 0.5;
      if (norm_ == Norm::cosine_l1) {
        weight *= scale * (square(along) - square(across * t_.cos_phi[p]));
      }
      samples_.weight[at] = static_cast<float>(weight);
      const int bins[2] = {here ? p : mirrored, there ? mirrored : p};
      for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t half = 0; half < 2; ++half) {
          const double value = values[static_cast<int>(c) * Measurement::bin_count + bins[half]];
          samples_.measured[c][half][at] = stored(value);
        }
      }
    }
  }

  float stored(double reflectance) const {
    const double value = std::min(reflectance / samples_.unit, most_units);
    return static_cast<float>(norm_ == Norm::log_l2 ? std::log(value + log_offset) : value);
  }

  const BinCentres& t_ = bin_centres();
  const Measurement& measurement_;
  const Norm norm_;
  const int threads_;
  const double min_cosine_;
  Samples samples_;
  std::vector<int> theta_d_;  // of each run
};

// How far samples stand from the median of 1, all channels and both halves pooled.
void measure_importance(const Samples& samples, const Samples::Run& run, float* importance) {
  for (std::size_t i = run.begin; i < run.end; ++i) {
    float distance = 0;
    for (const auto& channel : samples.measured) {
      for (const auto& half : channel) distance += std::abs(half[i] - 1);
    }
    importance[i] = std::sqrt(distance * samples.weight[i]);
  }
}

}  // namespace

Samples all_samples(const Measurement& measurement, const FitOptions& options) {
  return Builder(measurement, options).build();
}

Samples subsample(const Samples& all, std::size_t count, int threads) {
  SampleColumn<float> chance(all.size());
  std::vector<double> sums(all.runs.size());
  parallel_for(static_cast<int>(all.runs.size()), threads, [&](int r) {
    const Samples::Run& run = all.runs[static_cast<std::size_t>(r)];
    measure_importance(all, run, chance.data());
    const auto from = chance.begin();
    sums[static_cast<std::size_t>(r)] =
        std::accumulate(from + static_cast<std::ptrdiff_t>(run.begin),
                        from + static_cast<std::ptrdiff_t>(run.end), 0.0);
  });
  const double sum = std::accumulate(sums.begin(), sums.end(), 0.0);
  const auto size = static_cast<double>(std::max<std::size_t>(all.size(), 1));
  // A small even share keeps every weight bounded: a bin at the median must not be impossible.
  // Where every bin is at the median it is all there is.
  const double even = sum > 0 ? 0.1 * sum / size : 1;
  Samples drawn;
  drawn.unit = all.unit;
  const double per_draw = (sum > 0 ? 1.1 * sum : size) / static_cast<double>(count);
  double until_next = 0.5;
  for (const Samples::Run& run : all.runs) {
    begin_run(drawn, run.cos_theta_d);
    for (std::size_t i = run.begin; i < run.end; ++i) {
      if (!(all.weight[i] > 0)) continue;
      const double expected = (chance[i] + even) / per_draw;
      until_next -= expected;
      if (until_next >= 0) continue;
      const double draws = std::ceil(-until_next);
      until_next += draws;
      append(drawn, all, i);
      drawn.weight.back() = static_cast<float>(all.weight[i] * draws / expected);
    }
    end_run(drawn);
  }
  return drawn;
}

Samples every_nth(const Samples& samples, std::size_t n) {
  Samples thinned;
  thinned.unit = samples.unit;
  std::size_t seen = n / 2;
  for (const Samples::Run& run : samples.runs) {
    begin_run(thinned, run.cos_theta_d);
    for (std::size_t i = run.begin; i < run.end; ++i) {
      if (!(samples.weight[i] > 0) || ++seen % n != 0) continue;
      append(thinned, samples, i);
      thinned.weight.back() *= static_cast<float>(n);
    }
    end_run(thinned);
  }
  return thinned;
}

}  // namespace lobefit
