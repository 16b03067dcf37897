// What a person waits for, part by part: ./dev bench fit
//
// Beside the time of each part stands its ratio to the floor, which is copying the table's file
// into memory that was touched before, and what is the same on every machine: passes over the
// samples, samples touched by all of them, iterations, and the error where there is one.
#include "fitting/fit.h"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include "fitting/minimise.h"
#include "fitting/objective.h"
#include "fitting/samples.h"
#include "fitting/scan.h"
#include "fitting/variables.h"
#include "measurement/merl.h"
#include "measurement/parallel.h"
#include "reflectance/abc.h"

namespace lobefit {
namespace {

using Clock = std::chrono::steady_clock;

const Measurement& sample() {
  static const Measurement measurement = sample_measurement(sample_names().front());
  return measurement;
}

// The sample as a file, as long as the program runs.
class File {
 public:
  File() { write_merl(sample(), path); }
  ~File() { std::filesystem::remove(path); }

  const std::filesystem::path path = std::filesystem::temp_directory_path() / "lobefit_fit.binary";
};

const std::filesystem::path& file() {
  static const File file;
  return file.path;
}

void copy_file(std::vector<char>& memory) {
  std::ifstream stream(file(), std::ios::binary);
  stream.read(memory.data(), static_cast<std::streamsize>(memory.size()));
  benchmark::DoNotOptimize(memory.data());
}

// Seconds, the least of nine.
double floor_seconds() {
  static const double least = [] {
    std::vector<char> memory(std::filesystem::file_size(file()));
    double seconds = std::numeric_limits<double>::infinity();
    for (int round = 0; round < 9; ++round) {
      const Clock::time_point start = Clock::now();
      copy_file(memory);
      seconds = std::min(seconds, std::chrono::duration<double>(Clock::now() - start).count());
    }
    return seconds;
  }();
  return least;
}

// Times the work, and counts in how many floors it is done.
template <typename Work>
void time_work(benchmark::State& state, const Work& work) {
  const double floor = floor_seconds();
  const Clock::time_point start = Clock::now();
  for (auto _ : state) work();
  const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
  state.counters["floors"] = seconds / static_cast<double>(state.iterations()) / floor;
}

// What the parts of a fit work on, as fit.cpp chooses it.
struct Parts {
  const FitOptions options{};
  const Monitor monitor{};
  const int threads = thread_count(0);
  const Variables variables{options.kind, options.fresnel, options.separate_channels,
                            Specular::peak};
  const Samples all = all_samples(sample(), options);
  const Samples some = subsample(all, 16000, threads), scanned = every_nth(some, 32);

  std::vector<Candidate> starts() const {
    return scan_shapes(scanned, variables, options.norm, 8, threads, monitor);
  }
  Minimum polish(const Samples& samples, const Eigen::VectorXd& x, const Precision& precision,
                 int by_threads) const {
    return minimise(samples, variables, options.norm, variables.all(), x, precision, by_threads,
                    monitor);
  }
};

const Parts& parts() {
  static const Parts parts;
  return parts;
}

void copy_table(benchmark::State& state) {
  std::vector<char> memory(std::filesystem::file_size(file()));
  time_work(state, [&] { copy_file(memory); });
}

void read_table(benchmark::State& state) {
  time_work(state, [] { benchmark::DoNotOptimize(read_merl(InputFile(file()))); });
}

void lay_samples_out(benchmark::State& state) {
  time_work(state, [] { benchmark::DoNotOptimize(all_samples(sample(), parts().options)); });
  state.counters["samples"] = static_cast<double>(parts().all.size());
}

void pass_over_all(benchmark::State& state) {
  const Eigen::VectorXd x = parts().starts().front().x;
  time_work(state, [&] {
    // A new objective, because one remembers its answers.
    const Objective objective(parts().all, parts().variables, parts().options.norm, 0.01,
                              parts().threads);
    benchmark::DoNotOptimize(objective.evaluate(x, Curvature::newton).value);
  });
  state.counters["samples"] = static_cast<double>(parts().all.size());
}

void scan_for_starts(benchmark::State& state) {
  time_work(state, [] { benchmark::DoNotOptimize(parts().starts()); });
  state.counters["samples"] = static_cast<double>(parts().scanned.size());
}

void polish_on(benchmark::State& state, const Samples& samples, const Eigen::VectorXd& from,
               const Precision& precision, int threads) {
  Minimum minimum;
  time_work(state, [&] { minimum = parts().polish(samples, from, precision, threads); });
  state.counters["iterations"] = minimum.iterations;
  state.counters["passes"] = minimum.passes;
  state.counters["touched"] = minimum.passes * static_cast<double>(samples.size());
}

Minimum polished_on_subsample() {
  return parts().polish(parts().some, parts().starts().front().x, finishing_precision(), 1);
}

void polish_on_subsample(benchmark::State& state) {
  polish_on(state, parts().some, parts().starts().front().x, finishing_precision(), 1);
}

void polish_on_all(benchmark::State& state) {
  polish_on(state, parts().all, polished_on_subsample().x, last_precision(), parts().threads);
}

void fit_table(benchmark::State& state, ModelKind kind, Schedule schedule) {
  const FitOptions options{.kind = kind, .schedule = schedule};
  Fit fit;
  time_work(state, [&] {
    Monitor monitor;
    fit = fit_model(sample(), options, monitor);
  });
  for (const Stage& stage : fit.stages) {
    state.counters["iterations"] += stage.iterations;
    state.counters["touched"] += stage.touched;
  }
  state.counters["relative_l1"] = fit.errors.relative_l1.pooled;
}

void in_real_time(benchmark::internal::Benchmark* benchmark) {
  benchmark->Unit(benchmark::kMillisecond)->UseRealTime();
}

BENCHMARK(copy_table)->Apply(in_real_time);
BENCHMARK(read_table)->Apply(in_real_time);
BENCHMARK(lay_samples_out)->Apply(in_real_time);
BENCHMARK(pass_over_all)->Apply(in_real_time);
BENCHMARK(scan_for_starts)->Apply(in_real_time);
BENCHMARK(polish_on_subsample)->Apply(in_real_time);
BENCHMARK(polish_on_all)->Apply(in_real_time);

void add_fits() {
  const auto add = [](ModelKind kind, Schedule schedule) {
    const std::string name =
        "fit " + std::string(name_of(kind)) + ", " + std::string(name_of(schedule));
    benchmark::RegisterBenchmark(name.c_str(), fit_table, kind, schedule)->Apply(in_real_time);
  };
  add(ModelKind::modified_phong, Schedule::polish);
  add(ModelKind::modified_blinn_phong, Schedule::polish);
  for (const Schedule schedule :
       {Schedule::polish, Schedule::subsample, Schedule::joint, Schedule::stages}) {
    add(ModelKind::interpolated, schedule);
  }
}

}  // namespace
}  // namespace lobefit

int main(int count, char** arguments) {
  lobefit::add_fits();
  benchmark::Initialize(&count, arguments);
  if (benchmark::ReportUnrecognizedArguments(count, arguments)) return 2;
  benchmark::RunSpecifiedBenchmarks();
}
