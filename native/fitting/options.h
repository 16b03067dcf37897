// What a fit is asked to do.
#pragma once

#include <string_view>

#include "reflectance/model.h"

namespace lobefit {

// How the misfit f - m of a bin is counted:
//   l1         |f - m|, the paper's
//   cosine_l1  |f - m| weighted by solid angle and both cosines: what a picture shows
//   l2         (f - m)^2
//   log_l2     (log(f + e) - log(m + e))^2, e = 1/100 of the median reflectance
enum class Norm { l1, cosine_l1, l2, log_l2 };

// stages     the paper's three on all bins from the best start: (i) rho_d, k_s; (ii) s, alpha, eta;
//            (iii) s, alpha, k_s, eta
// polish     all parameters jointly: from every start on a subsample, the best then on all bins
// joint      all parameters jointly on all bins from the best start
// subsample  polish without its end on all bins
enum class Schedule { stages, polish, joint, subsample };

struct FitOptions {
  ModelKind kind = ModelKind::interpolated;
  bool fresnel = true;
  Schedule schedule = Schedule::polish;
  Norm norm = Norm::l1;
  // Bins where the light or the viewer stands further than this from the normal are left out.
  double max_angle_degrees = 90;
  // One exponent a channel instead of a shared one.
  bool separate_channels = false;
  // Also finds how well the data determine the parameters (jackknife.h).
  bool uncertainty = false;
  // 0 takes as many as the machine has. The result does not depend on it.
  int threads = 0;
};

// The names of the command line: "l1", "cosine-l1", "l2", "log-l2" and "stages", "polish",
// "joint", "subsample". The readers throw InputError for any other name.
std::string_view name_of(Norm norm);
Norm norm_named(std::string_view name);
std::string_view name_of(Schedule schedule);
Schedule schedule_named(std::string_view name);

}  // namespace lobefit
