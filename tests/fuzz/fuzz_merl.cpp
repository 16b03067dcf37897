// Any bytes as the beginning of a measured file, which zeros then make as long as the last four
// bytes say, so that 35 MB need not be made up: read, or refused by an InputError.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include "measurement/input_error.h"
#include "measurement/read_measurement.h"
#include "memory_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace lobefit;
  constexpr std::size_t most = std::size_t{1} << 27;
  std::uint32_t length = 0;
  if (size < sizeof(length)) return 0;
  const std::size_t rest = size - sizeof(length);
  std::memcpy(&length, data + rest, sizeof(length));
  const MemoryFile bytes({data, rest}, std::clamp<std::size_t>(length, rest, std::max(rest, most)));
  try {
    const Measurement measurement = read_measurement(bytes.path(), 1);
    const BinCounts& bins = measurement.bins();
    const auto all = bins.valid + bins.below_horizon + bins.negative + bins.non_finite;
    if (all != Measurement::bin_count || bins.valid == 0) std::abort();
  } catch (const InputError&) {
  }
  return 0;
}
