// From a measured file to all that a record holds.
#pragma once

#include <filesystem>
#include <memory>
#include <variant>
#include <vector>

#include "closures/principled.h"
#include "fitting/fit.h"
#include "measurement/measurement.h"

namespace lobefit {

// Directional albedo of measurement and model, by the viewer's angle from the normal in degrees.
struct AlbedoByViewAngle {
  std::vector<double> view_angle;
  std::vector<Rgb> measured, model;
};

struct RecordContents {
  BinCounts bins;
  Fit fit;
  AlbedoByViewAngle albedo;
  Principled principled;  // fitted to the measurement
  std::shared_ptr<const Measurement> measurement;
  double read_seconds = 0, total_seconds = 0;
};

using MeasurementSource = std::variant<std::filesystem::path, std::shared_ptr<const Measurement>>;

// Reads the file (where a path is given), fits the model, and finds the best Principled BSDF.
// Throws InputError and Cancelled.
RecordContents compute_record(const MeasurementSource& source, const FitOptions& options,
                              Monitor& monitor);

}  // namespace lobefit
