// What a person waits for: reading a table, and fitting each model to it.
#include <benchmark/benchmark.h>

#include <filesystem>

#include "fitting/fit.h"
#include "measurement/merl.h"
#include "reflectance/abc.h"

namespace lobefit {
namespace {

const Measurement& sample() {
  static const Measurement measurement = sample_measurement(sample_names().front());
  return measurement;
}

void read_table(benchmark::State& state) {
  const auto path = std::filesystem::temp_directory_path() / "lobefit_bench.binary";
  write_merl(sample(), path);
  for (auto _ : state) benchmark::DoNotOptimize(read_merl(path));
  std::filesystem::remove(path);
}
BENCHMARK(read_table)->Unit(benchmark::kMillisecond)->UseRealTime();

void fit_table(benchmark::State& state, ModelKind kind, Schedule schedule) {
  const FitOptions options{.kind = kind, .schedule = schedule};
  for (auto _ : state) {
    Monitor monitor;
    const Fit fit = fit_model(sample(), options, monitor);
    state.counters["relative_l1"] = fit.errors.relative_l1.pooled;
  }
}
BENCHMARK_CAPTURE(fit_table, modified_phong, ModelKind::modified_phong, Schedule::polish)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(fit_table, modified_blinn_phong, ModelKind::modified_blinn_phong,
                  Schedule::polish)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(fit_table, interpolated, ModelKind::interpolated, Schedule::polish)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(fit_table, interpolated_stages, ModelKind::interpolated, Schedule::stages)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

}  // namespace
}  // namespace lobefit

BENCHMARK_MAIN();
