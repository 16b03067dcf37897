// The ABC microfacet model and its published fits: believable tables without a download.
#pragma once

#include <string_view>
#include <vector>

#include "measurement/measurement.h"

namespace lobefit {

// The materials a sample can be made of, in alphabetical order.
std::vector<std::string_view> sample_names();

// The MERL-layout table of a material of sample_names(), evaluated from the ABC microfacet fit to
// the MERL material of that name by Low, Kronander, Ynnerman and Unger, "BRDF models for accurate
// and efficient rendering of glossy surfaces", ACM Transactions on Graphics 31(1), 2012:
//
//   f = (k_D + F(ior, wi.wh) D G / (cos theta_i cos theta_o)) / pi,
//   D = A / (1 + B (1 - cos theta_h))^C,
//   G = min(1, 2 (n.wh)(n.wi)/(wi.wh), 2 (n.wh)(n.wo)/(wi.wh)).
//
// It is that fit and not the measurement, and is to be called so. Throws InputError for another
// name.
Measurement sample_measurement(std::string_view name);

}  // namespace lobefit
