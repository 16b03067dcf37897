#include "closures/compute_record.h"

#include <chrono>

#include "measurement/read_measurement.h"
#include "reflectance/albedo.h"

namespace lobefit {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

std::shared_ptr<const Measurement> open(const MeasurementSource& source, int threads) {
  if (const auto* path = std::get_if<std::filesystem::path>(&source)) {
    return std::make_shared<const Measurement>(read_measurement(*path, threads));
  }
  return std::get<std::shared_ptr<const Measurement>>(source);
}

AlbedoByViewAngle albedo_by_view_angle(const Measurement& measurement,
                                       const Parameters& parameters) {
  AlbedoByViewAngle albedo;
  for (const double angle : {0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 85.0}) {
    albedo.view_angle.push_back(angle);
    albedo.measured.push_back(directional_albedo(
        [&](const Vector3& wi, const Vector3& wo) { return measurement.evaluate(wi, wo); },
        radians(angle)));
    albedo.model.push_back(directional_albedo(
        [&](const Vector3& wi, const Vector3& wo) { return evaluate_model(parameters, wi, wo); },
        radians(angle)));
  }
  return albedo;
}

}  // namespace

RecordContents compute_record(const MeasurementSource& source, const FitOptions& options,
                              Monitor& monitor) {
  const Clock::time_point start = Clock::now();
  RecordContents contents;
  monitor.report("Reading", 0);
  const std::shared_ptr<const Measurement> measurement = open(source, options.threads);
  contents.bins = measurement->bins();
  contents.measurement = measurement;
  contents.read_seconds = seconds_since(start);
  contents.fit = fit_model(*measurement, options, monitor);
  monitor.report("Measuring the albedo", 0.97);
  contents.albedo = albedo_by_view_angle(*measurement, contents.fit.parameters);
  monitor.throw_if_cancelled();
  monitor.report("Finding the Principled BSDF", 0.98);
  const Target target = sample_target(
      [&](const Vector3& wi, const Vector3& wo) { return measurement->evaluate(wi, wo); });
  contents.principled = fit_principled(target, options.threads);
  monitor.throw_if_cancelled();
  contents.total_seconds = seconds_since(start);
  return contents;
}

}  // namespace lobefit
