// The MERL BRDF file (Matusik et al. 2003, "A data-driven reflectance model").
#pragma once

#include <filesystem>

#include "measurement/input_file.h"
#include "measurement/measurement.h"

namespace lobefit {

// Reads a MERL `.binary`: three little-endian int32 (90, 90, 180), then the red, green and blue
// planes of 90*90*180 little-endian float64 in [theta_h][theta_d][phi_d] order. The stored value
// times 1/1500 (red), 1.15/1500 (green), 1.66/1500 (blue) is the reflectance in 1/sr. Files with
// 360 steps of phi_d hold each bin twice (phi_d and phi_d + 180 deg): the two are averaged, or
// the usable one of them is taken. Throws InputError when the file is not exactly of its size or
// has other dimensions. threads: at most so many, 0 for every processor.
Measurement read_merl(const InputFile& file, int threads = 0);

// Writes the layout that read_merl reads, with -1 in invalid bins, beside its place and then
// renames it, so that an interrupted write leaves no half file. Throws InputError.
void write_merl(const Measurement& measurement, const std::filesystem::path& path);

}  // namespace lobefit
