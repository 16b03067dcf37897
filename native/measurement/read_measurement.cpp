#include "measurement/read_measurement.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

#include "measurement/input_file.h"
#include "measurement/merl.h"
#include "measurement/rgl.h"
#include "measurement/tensor_file.h"

namespace lobefit {
namespace {

// Text has no control characters but those that part words, lines and pages; both formats that are
// read have zeros early on. UTF-16 is told by its byte order mark.
bool is_text(std::span<const unsigned char> head) {
  const bool utf_16 = head.size() > 1 && head[0] >= 0xfe && head[1] >= 0xfe && head[0] != head[1];
  const auto of_text = [](unsigned char c) { return c >= ' ' || (c >= '\t' && c <= '\r'); };
  return utf_16 || (!head.empty() && std::all_of(head.begin(), head.end(), of_text));
}

bool is_text(const InputFile& file) {
  std::array<unsigned char, 512> head;
  const auto bytes = static_cast<std::size_t>(std::min<std::uintmax_t>(file.size(), head.size()));
  file.read(0, head.data(), bytes);
  return is_text(std::span(head).first(bytes));
}

Measurement read_any(const InputFile& file, int threads) {
  if (TensorFile::recognises(file)) return read_rgl(file, threads);
  if (is_text(file)) {
    file.fail(
        "expected a MERL table (*.binary) or an RGL measurement (*.bsdf), found text; the BSDF "
        "formats of Zemax, LightTools and other programs are not read.");
  }
  return read_merl(file, threads);
}

}  // namespace

Measurement read_measurement(const std::filesystem::path& path, int threads) {
  const InputFile file(path);
  Measurement measurement = read_any(file, threads);
  if (measurement.bins().valid == 0) {
    const BinCounts& bins = measurement.bins();
    file.fail("expected reflectances, found no valid bin (" + with_commas(bins.negative) +
              " negative, " + with_commas(bins.non_finite) + " not finite, " +
              with_commas(bins.below_horizon) + " below the horizon).");
  }
  return measurement;
}

}  // namespace lobefit
