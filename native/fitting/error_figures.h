// How far a fit is from its measurement.
#pragma once

#include "measurement/measurement.h"
#include "reflectance/model.h"

namespace lobefit {

// One figure over all channels pooled, and over each.
struct ErrorFigure {
  double pooled = 0;
  Rgb rgb = Rgb::Zero();
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
};

ErrorFigures error_figures(const Measurement& measurement, const Parameters& parameters,
                           int threads);

}  // namespace lobefit
