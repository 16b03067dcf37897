#include "measurement/read_measurement.h"

#include <algorithm>
#include <string>

#include "measurement/input_error.h"
#include "measurement/merl.h"

namespace lobefit {

Measurement read_measurement(const std::filesystem::path& path, int threads) {
  std::string suffix = path.extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(),
                 [](unsigned char c) { return c < 128 ? static_cast<char>(std::tolower(c)) : c; });
  std::error_code ignored;
  if (suffix != ".binary" && std::filesystem::is_regular_file(path, ignored)) {
    throw InputError(path.string() + ": expected a MERL table named *.binary, found " +
                     (suffix.empty() ? "no suffix." : "the suffix '" + suffix + "'."));
  }
  return read_merl(path, threads);
}

}  // namespace lobefit
