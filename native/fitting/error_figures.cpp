#include "fitting/error_figures.h"

#include <array>
#include <cmath>
#include <vector>

#include "fitting/kernel.h"
#include "measurement/parallel.h"
#include "reflectance/fresnel.h"

namespace lobefit {
namespace {

// Sums of weight |f - m| and of weight m.
struct Misfit {
  Rgb error = Rgb::Zero(), mass = Rgb::Zero();

  void add(double weight, const Rgb& distance, const Rgb& measured) {
    error += weight * distance;
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

// A row of folded bins is padded to what the kernel takes at once.
constexpr int folded_phi_bins = Measurement::folded_phi_bins;
using Row = Eigen::Array<double, (folded_phi_bins + 3) / 4 * 4, 1>;

// The model and what its misfit weighs on the folded bins of one theta_h and theta_d.
struct FoldedRow {
  std::array<Row, 3> model;
  Row lower_cosine;  // of light and viewer
  Row weight;        // solid angle and both cosines
};

class RowFiller {
 public:
  explicit RowFiller(const Parameters& parameters) : lobe_(as_interpolated(parameters)) {
    cos_phi_.setZero();
    for (int p = 0; p < folded_phi_bins; ++p) cos_phi_[p] = t_.cos_phi[p];
  }

  FoldedRow operator()(int h, int d) const {
    const double along = t_.cos_h[h] * t_.cos_d[d], across = t_.sin_h[h] * t_.sin_d[d];
    Row u_phong, u_blinn;
    for (int p = 0; p < Row::SizeAtCompileTime; ++p) {
      const LobeCoordinates at =
          lobe_coordinates(t_.sin_h[h], t_.cos_h[h], t_.cos_d[d], t_.sin_d[d] * cos_phi_[p]);
      u_phong[p] = at.u_phong;
      u_blinn[p] = at.u_blinn;
    }
    const double fresnel = lobe_.ior ? fresnel_reflectance(t_.cos_d[d], *lobe_.ior).value : 1;
    FoldedRow row;
    Row power;
    for (int c = 0; c < 3; ++c) {
      if (c == 0 || lobe_.exponent[c] != lobe_.exponent[c - 1]) {
        run_powers({Row::SizeAtCompileTime, u_phong.data(), u_blinn.data(), lobe_.exponent[c],
                    lobe_.interpolation},
                   power.data());
      }
      row.model[static_cast<std::size_t>(c)] =
          lobe_.diffuse[c] / pi + lobe_.specular[c] * fresnel * power;
    }
    row.lower_cosine = along - across * cos_phi_;
    row.weight = t_.solid_angle(h, d) * row.lower_cosine * (along + across * cos_phi_);
    return row;
  }

 private:
  const BinCentres& t_ = bin_centres();
  const Parameters lobe_;
  Row cos_phi_;
};

// `share` is what a bin counts; of 1 / bins, so that no sum is larger than the largest value.
Misfits misfits_of_row(const Measurement& measurement, const RowFiller& fill, int h, double share) {
  static const double cos_80 = std::cos(radians(80));
  Misfits sums;
  for (int d = 0; d < Measurement::theta_d_bins; ++d) {
    const FoldedRow row = fill(h, d);
    const double* const values = measurement.planes().data() + Measurement::index(h, d, 0);
    for (int p = 0; p < folded_phi_bins; ++p) {
      for (const int bin : {p, Measurement::phi_d_bins - 1 - p}) {
        if (std::isnan(values[bin])) continue;
        const Rgb measured(values[bin], values[bin + Measurement::bin_count],
                           values[bin + 2 * Measurement::bin_count]);
        const Rgb error = (Rgb(row.model[0][p], row.model[1][p], row.model[2][p]) - measured).abs();
        sums.plain.add(share, error, measured);
        if (row.lower_cosine[p] > cos_80) sums.within_80.add(share, error, measured);
        sums.cosine.add(share * row.weight[p], error, measured);
      }
    }
  }
  return sums;
}

}  // namespace

ErrorFigures error_figures(const Measurement& measurement, const Parameters& parameters,
                           int threads) {
  std::vector<Misfits> rows(Measurement::theta_h_bins);
  const RowFiller fill(parameters);
  const double share = 1.0 / std::max(measurement.bins().valid, 1);
  parallel_for(Measurement::theta_h_bins, threads, [&](int h) {
    rows[static_cast<std::size_t>(h)] = misfits_of_row(measurement, fill, h, share);
  });
  Misfits total;
  for (const Misfits& row : rows) total.add(row);
  return {{total.plain.error.mean(), total.plain.error},
          total.plain.relative(),
          total.within_80.relative(),
          total.cosine.relative()};
}

}  // namespace lobefit
