// Reads any measured reflectance file that the project knows.
#pragma once

#include <filesystem>

#include "measurement/measurement.h"

namespace lobefit {

// Reads a MERL table from a file named *.binary, on at most so many threads (0: every processor).
// Throws InputError.
Measurement read_measurement(const std::filesystem::path& path, int threads = 0);

}  // namespace lobefit
