// Colours of spectra.
#pragma once

#include <span>
#include <vector>

#include "measurement/vector3.h"

namespace lobefit {

// The weight of each of these wavelengths (nanometres, rising) such that the weighted sum of a
// reflectance sampled there is its colour in linear Rec.709 under daylight (CIE D65, the white of
// Rec.709) for the CIE 1931 2-degree observer, by the trapezoid rule. The weights of a channel add
// up to 1, so that a reflectance that is the same at all wavelengths has three equal channels,
// and a white one (1, 1, 1), however coarse the samples. Colours beyond the gamut have negative
// channels.
std::vector<Rgb> rgb_weights(std::span<const float> wavelengths);

}  // namespace lobefit
