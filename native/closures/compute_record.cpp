#include "closures/compute_record.h"

#include <chrono>
#include <string>

#include "measurement/input_error.h"
#include "measurement/parallel.h"
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

// fit_model, whose errors here name the source.
Fit fit_named(const MeasurementSource& source, const Measurement& measurement,
              const FitOptions& options, Monitor& monitor) {
  try {
    return fit_model(measurement, options, monitor);
  } catch (const InputError& error) {
    const auto* path = std::get_if<std::filesystem::path>(&source);
    throw InputError((path ? path->string() : "measurement") + ": " + error.what());
  }
}

AlbedoByViewAngle albedo_by_view_angle(const Measurement& measurement, const Parameters& parameters,
                                       int threads) {
  const Reflectance measured = [&](const Vector3& wi, const Vector3& wo) {
    return measurement.evaluate(wi, wo);
  };
  const Reflectance model = [&](const Vector3& wi, const Vector3& wo) {
    return evaluate_model(parameters, wi, wo);
  };
  AlbedoByViewAngle albedo;
  albedo.view_angle = {0, 15, 30, 45, 60, 75, 85};
  const auto count = albedo.view_angle.size();
  albedo.measured.resize(count);
  albedo.model.resize(count);
  parallel_for(static_cast<int>(2 * count), thread_count(threads), [&](int i) {
    const auto at = static_cast<std::size_t>(i) / 2;
    (i % 2 == 0 ? albedo.measured : albedo.model)[at] =
        directional_albedo(i % 2 == 0 ? measured : model, radians(albedo.view_angle[at]));
  });
  return albedo;
}

}  // namespace

RecordContents compute_record(const MeasurementSource& source, const FitOptions& options,
                              Monitor& monitor) {
  const Clock::time_point start = Clock::now();
  const Crew crew(thread_count(options.threads));
  RecordContents contents;
  monitor.report("Reading", 0);
  const std::shared_ptr<const Measurement> measurement = open(source, options.threads);
  contents.bins = measurement->bins();
  contents.measurement = measurement;
  contents.read_seconds = seconds_since(start);
  contents.fit = fit_named(source, *measurement, options, monitor);
  const std::vector<std::string>& warnings = measurement->source().warnings;
  contents.fit.warnings.insert(contents.fit.warnings.begin(), warnings.begin(), warnings.end());
  monitor.report("Measuring the albedo", 0.97);
  contents.albedo = albedo_by_view_angle(*measurement, contents.fit.parameters, options.threads);
  monitor.throw_if_cancelled();
  monitor.report("Finding the Principled BSDF", 0.98);
  const Target target = sample_target(
      [&](const Vector3& wi, const Vector3& wo) { return measurement->evaluate(wi, wo); },
      options.threads);
  contents.principled = fit_principled(target, options.threads);
  monitor.throw_if_cancelled();
  contents.total_seconds = seconds_since(start);
  return contents;
}

}  // namespace lobefit
