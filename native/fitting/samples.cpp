#include "fitting/samples.h"

#include <algorithm>
#include <cmath>

#include "reflectance/model.h"

namespace lobefit {
namespace {

constexpr int folded_phi_bins = Measurement::phi_d_bins / 2;

// The median of the finite values of all channels, or something positive in its place: values of
// a table that is mostly zero are measured by their mean, those of an all-zero one by 1.
double typical_reflectance(const Measurement& measurement) {
  std::vector<double> values;
  values.reserve(3 * static_cast<std::size_t>(measurement.bins().valid));
  double sum = 0;
  for (const double value : measurement.planes()) {
    if (std::isnan(value)) continue;
    values.push_back(value);
    sum += value;
  }
  if (values.empty()) return 1;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (*middle > 0) return *middle;
  return sum > 0 ? sum / static_cast<double>(values.size()) : 1;
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
  for_each_column(samples, [padded](auto& column) { column.resize(padded); });
  samples.runs.back().end = padded;
  if (samples.runs.back().begin == padded) samples.runs.pop_back();
}

class Builder {
 public:
  Builder(const Measurement& measurement, const FitOptions& options)
      : measurement_(measurement),
        norm_(options.norm),
        min_cosine_(std::cos(radians(std::min(options.max_angle_degrees, 90.0)))) {
    samples_.unit = typical_reflectance(measurement);
    const auto expected = static_cast<std::size_t>(measurement.bins().valid) / 2;
    for_each_column(samples_, [expected](auto& column) { column.reserve(expected); });
  }

  Samples build() {
    for (int d = 0; d < Measurement::theta_d_bins; ++d) {
      begin_run(samples_, std::cos(Measurement::centre(0, d, 0).theta_d));
      for (int h = 0; h < Measurement::theta_h_bins; ++h) {
        for (int p = 0; p < folded_phi_bins; ++p) add(h, d, p);
      }
      end_run(samples_);
    }
    return std::move(samples_);
  }

 private:
  void add(int h, int d, int p) {
    const int mirrored = Measurement::phi_d_bins - 1 - p;
    const bool first = measurement_.valid(h, d, p), second = measurement_.valid(h, d, mirrored);
    if (!first && !second) return;
    const HalfDifference centre = Measurement::centre(h, d, p);
    const Directions directions = to_directions(centre);
    const double cos_i = directions.wi.z(), cos_o = directions.wo.z();
    if (std::min(cos_i, cos_o) <= min_cosine_) return;
    const LobeCoordinates at = lobe_coordinates(centre);
    samples_.u_phong.push_back(at.u_phong);
    samples_.u_blinn.push_back(at.u_blinn);
    double weight = first && second ? 1 : 0.5;
    if (norm_ == Norm::cosine_l1) weight *= solid_angle_and_cosines(h, centre, cos_i * cos_o);
    samples_.weight.push_back(static_cast<float>(weight));
    const Rgb values[2] = {measurement_.bin(h, d, first ? p : mirrored),
                           measurement_.bin(h, d, second ? mirrored : p)};
    for (int c = 0; c < 3; ++c) {
      for (int half = 0; half < 2; ++half) {
        samples_.measured[c][half].push_back(stored(values[half][c]));
      }
    }
  }

  // sin(theta_h) dtheta_h sin(theta_d) cos(theta_d) cos(theta_i) cos(theta_o), to a mean near 1.
  static double solid_angle_and_cosines(int h, const HalfDifference& centre, double cosines) {
    const double step = 2 * (h + 0.5) / Measurement::theta_h_bins;
    return 8 * std::sin(centre.theta_h) * step * std::sin(2 * centre.theta_d) * cosines;
  }

  float stored(double reflectance) const {
    const double value = reflectance / samples_.unit;
    return static_cast<float>(norm_ == Norm::log_l2 ? std::log(value + log_offset) : value);
  }

  const Measurement& measurement_;
  const Norm norm_;
  const double min_cosine_;
  Samples samples_;
};

// How far a sample stands from the median of 1, all channels and both halves pooled.
double importance(const Samples& samples, std::size_t i) {
  double distance = 0;
  for (const auto& channel : samples.measured) {
    for (const auto& half : channel) distance += std::abs(static_cast<double>(half[i]) - 1);
  }
  return samples.weight[i] > 0 ? std::sqrt(distance) * std::sqrt(samples.weight[i]) : 0;
}

}  // namespace

Samples all_samples(const Measurement& measurement, const FitOptions& options) {
  return Builder(measurement, options).build();
}

Samples subsample(const Samples& all, std::size_t count) {
  std::vector<double> chance(all.size());
  double sum = 0;
  for (std::size_t i = 0; i < all.size(); ++i) sum += chance[i] = importance(all, i);
  // A small even share keeps every weight bounded: a bin at the median must not be impossible.
  const double even = 0.1 * sum / static_cast<double>(std::max<std::size_t>(all.size(), 1));
  Samples drawn;
  drawn.unit = all.unit;
  const double per_draw = 1.1 * sum / static_cast<double>(count);
  double until_next = 0.5;
  for (const Samples::Run& run : all.runs) {
    begin_run(drawn, run.cos_theta_d);
    for (std::size_t i = run.begin; i < run.end; ++i) {
      if (!(all.weight[i] > 0)) continue;
      const double expected = per_draw > 0 ? (chance[i] + even) / per_draw : 1;
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

}  // namespace lobefit
