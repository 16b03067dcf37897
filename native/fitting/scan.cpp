#include "fitting/scan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "fitting/kernel.h"
#include "measurement/parallel.h"
#include "reflectance/fresnel.h"

namespace lobefit {
namespace {

using Eigen::VectorXd;

// s from .1 to 3e5 in thirds of a decade, and one that lights little more than the first theta_h;
// alpha, where the least more than 0 tells sharp lobes apart at grazing angles; eta - 1 from where
// it makes one number with k_s to a mirror at all angles.
constexpr int exponent_steps = 21, steps_a_decade = 3;
constexpr double sharpest = 1e7;
constexpr std::array<double, 6> interpolations = {0, 0.02, 0.25, 0.5, 0.75, 1};
constexpr std::array<double, 6> excess_iors = {0.01, 0.15, 0.5, 1.5, 6, 60};

double log_exponent_at(int step) {
  if (step == exponent_steps - 1) return std::log(sharpest);
  return std::log(10) * (double(step) / steps_a_decade - 1);
}

// The columns of the grid, one for every (alpha, eta) that the model has, and their points, one for
// every s.
struct Grid {
  int interpolations_used, iors_used;
  int columns() const { return interpolations_used * iors_used; }
  std::size_t point(int a, std::ptrdiff_t e, int step) const {
    return static_cast<std::size_t>((e * interpolations_used + a) * exponent_steps + step);
  }
};

// Finds reflectances channel by channel, in single precision, which tells basins apart as well as
// any.
class ReflectanceSolver {
 public:
  using Column = Eigen::ArrayXf;

  ReflectanceSolver(const Samples& samples, Norm norm)
      : norm_(norm),
        linear_(norm == Norm::l1 || norm == Norm::cosine_l1),
        weight_(column(samples.weight)) {
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t half = 0; half < 2; ++half) {
        measured_[c][half] = column(samples.measured[c][half]);
      }
    }
  }

  // The rho_d/pi and k_s >= 0 of a lobe g that fit a channel best, from a guess: Newton steps of
  // the reweighted squares, whose smoothing falls from coarse to fine. Returns the sum of weight
  // |r|, or of weight r^2 for the square norms.
  double solve(int channel, const Column& g, float& diffuse, float& specular) const {
    for (const float smoothing : {0.3F, 0.1F, 0.03F}) {
      const Sums sums = sums_at(channel, g, diffuse, specular, smoothing);
      const float determinant = sums.w * sums.wgg * (1 + 1e-5F) - sums.wg * sums.wg;
      const float d = diffuse - (sums.wgg * sums.r - sums.wg * sums.rg) / determinant;
      const float k = specular - (sums.w * sums.rg - sums.wg * sums.r) / determinant;
      if (!(determinant > 0 && std::isfinite(d) && std::isfinite(k))) continue;
      diffuse = std::max(0.0F, d);
      specular = std::max(0.0F, k);
    }
    return sums_at(channel, g, diffuse, specular, 0.03F).true_value;
  }

 private:
  // As KernelSums.
  struct Sums {
    float w = 0, wg = 0, wgg = 0, r = 0, rg = 0, true_value = 0;
  };

  static Column column(const SampleColumn<float>& from) {
    return Eigen::Map<const Column>(from.data(), static_cast<Eigen::Index>(from.size()));
  }

  Sums sums_at(int channel, const Column& g, float diffuse, float specular, float smoothing) const {
    Sums sums;
    Column model = diffuse + specular * g, slope;
    if (norm_ == Norm::log_l2) {
      slope = (model + static_cast<float>(log_offset)).inverse();
      model = -slope.log();
    }
    for (const Column& measured : measured_[static_cast<std::size_t>(channel)]) {
      const Column r = model - measured;
      Column w = weight_;
      if (linear_) w /= (r.square() / (smoothing * smoothing) + 1).sqrt();
      sums.true_value += linear_ ? (weight_ * r.abs()).sum() : (weight_ * r.square()).sum();
      Column wr = w * r;
      if (norm_ == Norm::log_l2) {
        wr *= slope;
        w *= slope.square();
      }
      sums.w += w.sum();
      sums.r += wr.sum();
      sums.rg += (wr * g).sum();
      w *= g;
      sums.wg += w.sum();
      sums.wgg += (w * g).sum();
    }
    return sums;
  }

  const Norm norm_;
  const bool linear_;
  const Column weight_;
  std::array<std::array<Column, 2>, 3> measured_;
};

// The lobe of reflectance 1 at all samples: R_F base^s.
ReflectanceSolver::Column lobe_at(const Samples& samples, const Parameters& lobe) {
  Eigen::ArrayXd g(static_cast<Eigen::Index>(samples.size()));
  run_powers({samples.size(), samples.u_phong.data(), samples.u_blinn.data(), lobe.exponent[0],
              lobe.interpolation},
             g.data());
  for (const Samples::Run& run : samples.runs) {
    if (!lobe.ior) break;
    g.segment(static_cast<Eigen::Index>(run.begin),
              static_cast<Eigen::Index>(run.end - run.begin)) *=
        fresnel_reflectance(run.cos_theta_d, *lobe.ior).value;
  }
  return g.cast<float>();
}

// Fills one column of points; its alpha and eta are those of x, where it starts.
void scan_column(const Samples& samples, const Variables& variables,
                 const ReflectanceSolver& solver, VectorXd x, const Monitor& monitor,
                 Candidate* points) {
  for (int step = 0; step < exponent_steps; ++step) {
    monitor.throw_if_cancelled();
    const double log_exponent = log_exponent_at(step);
    x.segment(Variables::log_exponent, variables.exponents()).setConstant(log_exponent);
    const auto g = lobe_at(samples, as_interpolated(variables.to_parameters(x, 1)));
    double value = 0;
    // The reflectances of one exponent are close to those of the next.
    for (int c = 0; c < 3; ++c) {
      auto diffuse = static_cast<float>(x[Variables::diffuse + c]);
      const double scale = variables.specular_scale(x, c).factor;
      auto specular = static_cast<float>(scale * x[Variables::specular + c]);
      value += solver.solve(c, g, diffuse, specular);
      x[Variables::diffuse + c] = diffuse;
      x[Variables::specular + c] = specular / scale;
    }
    points[step] = {x, value};
  }
}

// Where a column begins: diffuse alone.
VectorXd column_start(const Variables& variables, int a, int e) {
  VectorXd x = VectorXd::Zero(variables.count());
  x.segment<3>(Variables::diffuse).setOnes();
  if (variables.interpolation() >= 0) {
    x[variables.interpolation()] = interpolations[static_cast<std::size_t>(a)];
  }
  if (variables.log_excess_ior() >= 0) {
    x[variables.log_excess_ior()] = std::log(excess_iors[static_cast<std::size_t>(e)]);
  }
  return x;
}

// The best point of every column and those from which no step along an axis leads down, best first.
std::vector<Candidate> sorted_starts(const Grid& grid, const std::vector<Candidate>& points) {
  std::vector<Candidate> starts;
  const auto best_first = [](const Candidate& left, const Candidate& right) {
    return left.true_value < right.true_value;
  };
  const auto is_lowest = [&](int a, int e, int step) {
    const double value = points[grid.point(a, e, step)].true_value;
    const auto leads_down = [&](int to_a, int to_e, int to_step) {
      return to_a >= 0 && to_a < grid.interpolations_used && to_e >= 0 && to_e < grid.iors_used &&
             to_step >= 0 && to_step < exponent_steps &&
             points[grid.point(to_a, to_e, to_step)].true_value < value;
    };
    return !(leads_down(a - 1, e, step) || leads_down(a + 1, e, step) ||
             leads_down(a, e - 1, step) || leads_down(a, e + 1, step) ||
             leads_down(a, e, step - 1) || leads_down(a, e, step + 1));
  };
  for (int e = 0; e < grid.iors_used; ++e) {
    for (int a = 0; a < grid.interpolations_used; ++a) {
      const auto column = points.begin() + static_cast<std::ptrdiff_t>(grid.point(a, e, 0));
      const auto best = std::min_element(column, column + exponent_steps, best_first);
      for (int step = 0; step < exponent_steps; ++step) {
        if (column + step == best || is_lowest(a, e, step)) starts.push_back(column[step]);
      }
    }
  }
  std::stable_sort(starts.begin(), starts.end(), best_first);
  return starts;
}

// The first of the sorted candidates, the first Phong (alpha = 0) and Blinn-Phong (alpha = 1) lobes
// always among them.
std::vector<Candidate> chosen(const std::vector<Candidate>& sorted, int interpolation,
                              std::size_t count) {
  std::vector<Candidate> result;
  bool seen[2] = {interpolation < 0, interpolation < 0};
  for (const Candidate& candidate : sorted) {
    bool first_of_its_kind = false;
    for (int kind = 0; kind < 2 && interpolation >= 0; ++kind) {
      if (candidate.x[interpolation] != kind || seen[kind]) continue;
      first_of_its_kind = seen[kind] = true;
    }
    const std::size_t reserved = (seen[0] ? 0 : 1) + (seen[1] ? 0 : 1);
    if (first_of_its_kind || result.size() + reserved < count) result.push_back(candidate);
  }
  return result;
}

}  // namespace

std::vector<Candidate> scan_shapes(const Samples& few, const Variables& variables, Norm norm,
                                   std::size_t count, int threads, const Monitor& monitor) {
  const Grid grid{variables.interpolation() >= 0 ? static_cast<int>(interpolations.size()) : 1,
                  variables.log_excess_ior() >= 0 ? static_cast<int>(excess_iors.size()) : 1};
  const ReflectanceSolver solver(few, norm);
  std::vector<Candidate> points(grid.point(0, grid.iors_used, 0));
  parallel_for(grid.columns(), threads, [&](int column) {
    const int a = column % grid.interpolations_used, e = column / grid.interpolations_used;
    scan_column(few, variables, solver, column_start(variables, a, e), monitor,
                points.data() + grid.point(a, e, 0));
  });
  return chosen(sorted_starts(grid, points), variables.interpolation(), count);
}

}  // namespace lobefit
