#include "measurement/merl.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>
#include <system_error>
#include <vector>

#include "measurement/input_error.h"

namespace lobefit {
namespace {

static_assert(std::endian::native == std::endian::little, "MERL files are read in place");

constexpr std::array<double, 3> channel_scale = {1.0 / 1500, 1.15 / 1500, 1.66 / 1500};
constexpr std::array<const char*, 3> dimension_name = {"theta_h", "theta_d", "phi_d"};
using Dimensions = std::array<std::int32_t, 3>;
constexpr Dimensions dimensions = {Measurement::theta_h_bins, Measurement::theta_d_bins,
                                   Measurement::phi_d_bins};
constexpr int double_phi_bins = 2 * Measurement::phi_d_bins;

std::uintmax_t bytes_of(const Dimensions& size) {
  std::uintmax_t values = 3;
  for (const std::int32_t n : size) values *= static_cast<std::uintmax_t>(n);
  return sizeof(Dimensions) + values * sizeof(double);
}

bool has_merl_dimensions(const Dimensions& found) {
  return found[0] == dimensions[0] && found[1] == dimensions[1] &&
         (found[2] == dimensions[2] || found[2] == double_phi_bins);
}

std::int32_t byte_swapped(std::int32_t value) {
  return static_cast<std::int32_t>(__builtin_bswap32(static_cast<std::uint32_t>(value)));
}

void check_dimensions(const InputFile& file, const Dimensions& found) {
  if (has_merl_dimensions(found)) return;
  const std::string expected = "expected a MERL table of 90 x 90 x 180 bins, found ";
  Dimensions swapped = found;
  for (std::int32_t& n : swapped) n = byte_swapped(n);
  if (has_merl_dimensions(swapped)) {
    file.fail(expected +
              "these dimensions in big-endian byte order; MERL files are "
              "little-endian, was it written on another kind of machine?");
  }
  std::string wrong;
  for (int axis = 0; axis < 3; ++axis) {
    if (found[axis] == dimensions[axis]) continue;
    wrong += (wrong.empty() ? "" : ", ") + std::string(dimension_name[axis]) + " = " +
             std::to_string(found[axis]);
  }
  file.fail(expected + wrong + "; is this another format?");
}

Dimensions read_dimensions(const InputFile& file) {
  Dimensions found{};
  if (file.size() < sizeof(found)) {
    file.fail("expected a MERL table of " + with_commas(bytes_of(dimensions)) + " bytes, found " +
              (file.size() == 0 ? "an empty file." : with_commas(file.size()) + " bytes."));
  }
  file.read(0, found.data(), sizeof(found));
  return found;
}

void check_size(const InputFile& file, std::uintmax_t expected) {
  if (expected == file.size()) return;
  file.fail("expected " + with_commas(expected) + " bytes, found " + with_commas(file.size()) +
            (file.size() < expected ? "; was the file cut off while it was copied?"
                                    : "; there is something behind the table."));
}

// The mean of two stored values, or the usable one of them.
double merged(double first, double second) {
  const auto usable = [](double v) { return std::isfinite(v) && v >= 0; };
  if (usable(first) && usable(second)) return (first + second) / 2;
  return usable(second) ? second : first;
}

// Reads the rows of one theta_h after another from the three planes of a file.
class RowReader {
 public:
  RowReader(const InputFile& file, int phi_bins) : file_(file), phi_bins_(phi_bins) {}

  // What threads read goes through a piece of memory that is small and their own, so that they
  // touch the rows' memory for the first time, which is slow, all at once.
  void operator()(int h, const Measurement::Rows& rows) const {
    std::array<double, std::size_t{piece_theta_d} * double_phi_bins> piece;
    for (int c = 0; c < 3; ++c) {
      for (int d = 0; d < Measurement::theta_d_bins; d += piece_theta_d) {
        read(Measurement::theta_d_bins * (h + Measurement::theta_h_bins * c) + d, piece.data());
        double* const to = rows[static_cast<std::size_t>(c)] + Measurement::index(0, d, 0);
        for (int i = 0; i < piece_theta_d * Measurement::phi_d_bins; ++i) {
          to[i] = channel_scale[c] * stored(piece.data(), i);
        }
      }
    }
  }

 private:
  static constexpr int piece_theta_d = 18;
  static_assert(Measurement::theta_d_bins % piece_theta_d == 0);

  // Reads `piece_theta_d` steps of theta_d from the first-th in the file on.
  void read(int first, double* values) const {
    const auto before = static_cast<std::size_t>(phi_bins_) * static_cast<std::size_t>(first);
    const auto count = static_cast<std::size_t>(phi_bins_) * piece_theta_d;
    file_.read(sizeof(Dimensions) + sizeof(double) * before, values, sizeof(double) * count);
  }

  // The i-th of 180 steps of phi_d of a piece. Of 360, phi_d and phi_d + 180 deg are the same bin
  // by reciprocity.
  double stored(const double* piece, int i) const {
    if (phi_bins_ == Measurement::phi_d_bins) return piece[i];
    const std::ptrdiff_t row = i / Measurement::phi_d_bins;
    const int p = i % Measurement::phi_d_bins;
    const double* const values = piece + row * double_phi_bins;
    return merged(values[p], values[p + Measurement::phi_d_bins]);
  }

  const InputFile& file_;
  const int phi_bins_;
};

}  // namespace

Measurement read_merl(const InputFile& file, int threads) {
  const Dimensions found = read_dimensions(file);
  check_dimensions(file, found);
  check_size(file, bytes_of(found));
  return Measurement(RowReader(file, found[2]), threads);
}

void write_merl(const Measurement& measurement, const std::filesystem::path& path) {
  std::filesystem::path aside = path;
  aside += ".part";
  const auto give_up = [&](const std::string& why) {
    std::error_code ignored;
    std::filesystem::remove(aside, ignored);
    throw InputError(shown(path) + ": expected to write a MERL table of " +
                     with_commas(bytes_of(dimensions)) + " bytes, found: " + why + ".");
  };
  const auto reason = [] { return std::string(std::strerror(errno)); };
  std::vector<double> stored(measurement.planes().begin(), measurement.planes().end());
  File file = open_file(aside, "wb");
  if (!file) give_up(reason());
  for (int channel = 0; channel < 3; ++channel) {
    double* const plane = stored.data() + channel * Measurement::bin_count;
    std::transform(plane, plane + Measurement::bin_count, plane, [=](double value) {
      return std::isnan(value) ? -1.0 : value / channel_scale[channel];
    });
  }
  const bool written =
      std::fwrite(dimensions.data(), sizeof(dimensions), 1, file.get()) == 1 &&
      std::fwrite(stored.data(), sizeof(double), stored.size(), file.get()) == stored.size();
  // What is written may be refused as late as by the end.
  const bool closed = std::fclose(file.release()) == 0;
  if (!written || !closed) give_up(reason());
  std::error_code error;
  std::filesystem::rename(aside, path, error);
  if (error) give_up(error.message());
}

}  // namespace lobefit
