// The bins of a measurement, laid out for passes of a fit over them.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <new>
#include <utility>
#include <vector>

#include "fitting/kernel.h"
#include "fitting/options.h"
#include "measurement/measurement.h"

namespace lobefit {

// Memory that a vector leaves as it is when it grows without a value: it costs as much to touch for
// the first time as a fit takes for a pass, so that the threads which fill it share that.
template <typename T>
struct UntouchedMemory : std::allocator<T> {
  template <typename U>
  struct rebind {
    using other = UntouchedMemory<U>;
  };
  template <typename U>
  void construct(U* at) {
    ::new (static_cast<void*>(at)) U;
  }
  template <typename U, typename... Arguments>
  void construct(U* at, Arguments&&... arguments) {
    ::new (static_cast<void*>(at)) U(std::forward<Arguments>(arguments)...);
  }
};
template <typename T>
using SampleColumn = std::vector<T, UntouchedMemory<T>>;

// A model sees phi_d through cos^2 alone, so the bins phi_d and 180 deg - phi_d share one
// evaluation and make one sample. Both measured values are kept, since they differ by up to 17 %
// in real tables and their mean would be another objective. Where only one of the two is valid it
// stands twice, at half the weight.
//
// Samples of one theta_d stand together in a run, because the Fresnel reflectance is the same for
// all of them; a run is padded with samples of weight 0 to a multiple of `padding`. Values are in
// units of the median reflectance, or of the mean where the median is next to nothing.
struct Samples {
  static constexpr std::size_t padding = 4;
  struct Run {
    std::size_t begin, end;
    double cos_theta_d;
  };

  std::vector<Run> runs;
  // lobe_coordinates; in double, because 1 - u counts where u is close to 1.
  SampleColumn<double> u_phong, u_blinn;
  SampleColumn<float> weight;  // of each of the two measured values
  // measured[channel][half]: f, or log(f + log_offset) for Norm::log_l2.
  std::array<std::array<SampleColumn<float>, 2>, 3> measured;
  double unit = 1;  // the median reflectance or what stands for it, in 1/sr

  std::size_t size() const { return weight.size(); }
};

// All bins above the horizon and up to options.max_angle_degrees; invalid ones weigh 0.
Samples all_samples(const Measurement& measurement, const FitOptions& options);

// About `count` of them, drawn with probability proportional to the square root of their distance
// from the median (and so with weight 1/probability): systematic sampling, always the same draw.
// Two per cent of a table so drawn have the optimum of the whole to about 1e-4.
Samples subsample(const Samples& all, std::size_t count, int threads = 1);

// Each n-th of them, at n times its weight.
Samples every_nth(const Samples& samples, std::size_t n);

}  // namespace lobefit
