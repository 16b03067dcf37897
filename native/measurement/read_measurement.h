// Reads any measured reflectance file that the project knows.
#pragma once

#include <filesystem>

#include "measurement/measurement.h"

namespace lobefit {

// Reads a MERL table from a file named *.binary. Throws InputError.
Measurement read_measurement(const std::filesystem::path& path);

}  // namespace lobefit
