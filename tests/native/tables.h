// Tables of known lobes, and tables at the end of what a fit may meet.
#pragma once

#include <functional>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "measurement/measurement.h"
#include "reflectance/model.h"

namespace lobefit {

// A table and what is known about it. `truth` is there where the table is that of a model, and the
// fit then can be no worse than it; where the truth lies beyond the bounds of the fit, it is the
// nearest model within them. `degenerate` tables do not determine a model, and the fit has to say
// so in a warning.
struct ExtremeTable {
  std::string name;
  std::function<Measurement()> make;
  std::optional<Parameters> truth;
  bool degenerate = false;

  // GoogleTest would print the bytes, those between the members too, which nobody has written.
  friend void PrintTo(const ExtremeTable& table, std::ostream* out) { *out << table.name; }
};

// Every table that a fit has an answer to; one without a valid bin, no_valid_bin(), has none.
std::vector<ExtremeTable> extreme_tables();
Measurement no_valid_bin();

// The interpolated lobe with an index of refraction, of a diffuse part of some 0.2 and a lobe that
// reflects as much at normal incidence for s >= 1.
Parameters lobe_of(double exponent, double interpolation, double ior);
Measurement table_of(const Parameters& parameters);
// Under noise of up to this part of every value, the same at every run and in all channels.
Measurement noisy_table_of(const Parameters& parameters, double noise);
// Of bins that `value` gives the reflectance of; negative is invalid.
Measurement table_of(const std::function<Rgb(int h, int d, int p)>& value);

}  // namespace lobefit
