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

using Part = ErrorByAngle::Part;

void add(Part& to, double weight, double misfit, double measured) {
  to.misfit += weight * misfit;
  to.measured += weight * measured;
}

struct Misfits {
  Misfit plain, within_80, cosine;
  ErrorByAngle by_angle;

  void add(const Misfits& other) {
    plain.add(other.plain);
    within_80.add(other.within_80);
    cosine.add(other.cosine);
    for (std::size_t h = 0; h < by_angle.half_difference.size(); ++h) {
      add_all(by_angle.half_difference[h], other.by_angle.half_difference[h]);
    }
    add_all(by_angle.view, other.by_angle.view);
  }

 private:
  template <std::size_t size>
  static void add_all(std::array<Part, size>& to, const std::array<Part, size>& from) {
    for (std::size_t i = 0; i < size; ++i) lobefit::add(to[i], 1, from[i].misfit, from[i].measured);
  }
};

// The steps of ErrorByAngle::view that the two directions of a folded bin are in, as phi_d goes
// from 0 to 90 deg: the lower of them rises and the higher one sinks.
class ViewSteps {
 public:
  void move_to(double lower_cosine, double higher_cosine) {
    while (lower_ > 0 && lower_cosine > cosines()[lower_]) --lower_;
    while (higher_ + 1 < ErrorByAngle::views && higher_cosine <= cosines()[higher_ + 1]) ++higher_;
  }
  std::size_t lower() const { return lower_; }
  std::size_t higher() const { return higher_; }

 private:
  // Where each step begins.
  static const std::array<double, ErrorByAngle::views>& cosines() {
    static const auto table = [] {
      std::array<double, ErrorByAngle::views> cosines;
      for (std::size_t i = 0; i < cosines.size(); ++i) {
        cosines[i] = std::cos(radians(90.0 * static_cast<double>(i) / ErrorByAngle::views));
      }
      return cosines;
    }();
    return table;
  }

  std::size_t lower_ = ErrorByAngle::views - 1, higher_ = 0;
};

// A row of folded bins is padded to what the kernel takes at once.
constexpr int folded_phi_bins = Measurement::folded_phi_bins;
using Row = Eigen::Array<double, (folded_phi_bins + 3) / 4 * 4, 1>;

// The model and what its misfit weighs on the folded bins of one theta_h and theta_d.
struct FoldedRow {
  std::array<Row, 3> model;
  Row lower_cosine, higher_cosine;  // of light and viewer
  Row weight;                       // solid angle and both cosines
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
    row.higher_cosine = along + across * cos_phi_;
    row.weight = t_.solid_angle(h, d) * row.lower_cosine * row.higher_cosine;
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
  constexpr int bins_of_cell = Measurement::theta_h_bins / ErrorByAngle::cells;
  static_assert(Measurement::theta_d_bins == Measurement::theta_h_bins);
  Misfits sums;
  auto& cells = sums.by_angle.half_difference[static_cast<std::size_t>(h / bins_of_cell)];
  for (int d = 0; d < Measurement::theta_d_bins; ++d) {
    const FoldedRow row = fill(h, d);
    const double* const values = measurement.planes().data() + Measurement::index(h, d, 0);
    Misfit plain;
    ViewSteps step;
    for (int p = 0; p < folded_phi_bins; ++p) {
      Misfit both;
      for (const int bin : {p, Measurement::phi_d_bins - 1 - p}) {
        if (std::isnan(values[bin])) continue;
        const Rgb measured(values[bin], values[bin + Measurement::bin_count],
                           values[bin + 2 * Measurement::bin_count]);
        both.add(share, (Rgb(row.model[0][p], row.model[1][p], row.model[2][p]) - measured).abs(),
                 measured);
      }
      plain.add(both);
      if (row.lower_cosine[p] > cos_80) sums.within_80.add(both);
      sums.cosine.add(row.weight[p], both.error, both.mass);
      step.move_to(row.lower_cosine[p], row.higher_cosine[p]);
      for (const std::size_t view : {step.lower(), step.higher()}) {
        add(sums.by_angle.view[view], row.weight[p] / 2, both.error.sum(), both.mass.sum());
      }
    }
    sums.plain.add(plain);
    add(cells[static_cast<std::size_t>(d / bins_of_cell)], 1, plain.error.sum(), plain.mass.sum());
  }
  return sums;
}

ErrorByAngle relative(ErrorByAngle parts, double plain_mass, double cosine_mass) {
  const auto divide = [](auto& row, double mass) {
    for (Part& part : row)
      part = mass > 0 ? Part{part.misfit / mass, part.measured / mass} : Part{};
  };
  for (auto& row : parts.half_difference) divide(row, plain_mass);
  divide(parts.view, cosine_mass);
  return parts;
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
          total.cosine.relative(),
          relative(total.by_angle, total.plain.mass.sum(), total.cosine.mass.sum())};
}

}  // namespace lobefit
