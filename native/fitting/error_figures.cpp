#include "fitting/error_figures.h"

#include <cmath>
#include <vector>

#include "fitting/parallel.h"
#include "reflectance/fresnel.h"

namespace lobefit {
namespace {

// Sums of weight |f - m| and of weight m.
struct Misfit {
  Rgb error = Rgb::Zero(), mass = Rgb::Zero();

  void add(double weight, const Rgb& model, const Rgb& measured) {
    error += weight * (model - measured).abs();
    mass += weight * measured;
  }
  void add(const Misfit& other) {
    error += other.error;
    mass += other.mass;
  }
  // Relative to the mass; an all-black measurement has no relative error but 0.
  ErrorFigure relative() const {
    const auto ratio = [](double part, double whole) { return whole > 0 ? part / whole : 0; };
    return {ratio(error.sum(), mass.sum()),
            {ratio(error[0], mass[0]), ratio(error[1], mass[1]), ratio(error[2], mass[2])}};
  }
};

struct Misfits {
  Misfit plain, within_80, cosine;

  void add(const Misfits& other) {
    plain.add(other.plain);
    within_80.add(other.within_80);
    cosine.add(other.cosine);
  }
};

Misfits misfits_of_row(const Measurement& measurement, const Parameters& parameters, int h) {
  static const double cos_80 = std::cos(radians(80));
  constexpr int last = Measurement::phi_d_bins - 1;
  Misfits sums;
  for (int d = 0; d < Measurement::theta_d_bins; ++d) {
    // A model sees cos^2 phi_d alone: one evaluation serves phi_d and 180 deg - phi_d.
    for (int p = 0; p <= last / 2; ++p) {
      const bool valid[2] = {measurement.valid(h, d, p), measurement.valid(h, d, last - p)};
      if (!valid[0] && !valid[1]) continue;
      const HalfDifference centre = Measurement::centre(h, d, p);
      const Directions directions = to_directions(centre);
      const double cos_i = directions.wi.z(), cos_o = directions.wo.z();
      const Rgb model = evaluate_model(parameters, centre);
      const double width = h + 0.5;  // dtheta_h, up to a factor
      const double weight = std::sin(centre.theta_h) * width * std::sin(centre.theta_d) *
                            std::cos(centre.theta_d) * cos_i * cos_o;
      for (int half = 0; half < 2; ++half) {
        if (!valid[half]) continue;
        const Rgb measured = measurement.bin(h, d, half ? last - p : p);
        sums.plain.add(1, model, measured);
        if (std::min(cos_i, cos_o) > cos_80) sums.within_80.add(1, model, measured);
        sums.cosine.add(weight, model, measured);
      }
    }
  }
  return sums;
}

}  // namespace

ErrorFigures error_figures(const Measurement& measurement, const Parameters& parameters,
                           int threads) {
  std::vector<Misfits> rows(Measurement::theta_h_bins);
  parallel_for(Measurement::theta_h_bins, threads, [&](int h) {
    rows[static_cast<std::size_t>(h)] = misfits_of_row(measurement, parameters, h);
  });
  Misfits total;
  for (const Misfits& row : rows) total.add(row);
  const double bins = std::max(measurement.bins().valid, 1);
  return {{total.plain.error.sum() / (3 * bins), total.plain.error / bins},
          total.plain.relative(),
          total.within_80.relative(),
          total.cosine.relative()};
}

}  // namespace lobefit
