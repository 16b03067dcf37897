// Reads any measured reflectance file that the project knows.
#pragma once

#include <filesystem>

#include "measurement/measurement.h"

namespace lobefit {

// Reads a MERL table or an RGL file, told apart by what is in them and not by their names, on at
// most so many threads (0: every processor). Throws InputError when the file cannot be read, is of
// another format, is damaged or holds no valid bin.
Measurement read_measurement(const std::filesystem::path& path, int threads = 0);

}  // namespace lobefit
