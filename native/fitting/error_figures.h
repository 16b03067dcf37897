// How far a fit is from its measurement.
#pragma once

#include <array>

#include "measurement/measurement.h"
#include "reflectance/model.h"

namespace lobefit {

// One figure over all channels pooled, and over each.
struct ErrorFigure {
  double pooled = 0;
  Rgb rgb = Rgb::Zero();
};

// Where the error stands: sums of |f - m| and of m of all channels over the bins of a part, both
// relative to the sum of m over all parts. So their ratio is the relative error of the part, and
// the misfits of all parts together are the relative error of the whole.
struct ErrorByAngle {
  struct Part {
    double misfit = 0, measured = 0;
  };
  // Of bins as they are (relative_l1): [theta_h][theta_d], each of 6 bins of the table, so that
  // theta_h ends at ((i + 1) / 15)^2 90 deg and theta_d at (i + 1) 6 deg.
  static constexpr int cells = 15;
  std::array<std::array<Part, cells>, cells> half_difference;
  // Of bins weighted as for relative_l1_cosine, by the viewer's angle from the normal in steps of
  // 5 deg. A bin stands for two views, since light and viewer may be exchanged.
  static constexpr int views = 18;
  std::array<Part, views> view;
};

// Over all valid bins at their centres; m measured, f fitted, in double, without weights unless
// said:
//   l1                   mean |f - m|, in 1/sr
//   relative_l1          sum |f - m| / sum m
//   relative_l1_80       the same inside theta_i, theta_o < 80 deg
//   relative_l1_cosine   sum w |f - m| / sum w m,
//                        w = sin theta_h dtheta_h sin theta_d cos theta_d cos theta_i cos theta_o
struct ErrorFigures {
  ErrorFigure l1, relative_l1, relative_l1_80, relative_l1_cosine;
  ErrorByAngle by_angle;
};

ErrorFigures error_figures(const Measurement& measurement, const Parameters& parameters,
                           int threads);

}  // namespace lobefit
