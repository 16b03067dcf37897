#include "measurement/rgl.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <span>
#include <utility>

#include "measurement/bilinear.h"
#include "measurement/half_difference.h"
#include "measurement/spectrum.h"

namespace lobefit {
namespace {

using Shape = TensorFile::Shape;

const Rgb unknown = Rgb::Constant(std::numeric_limits<double>::quiet_NaN());

// Elevations are float32 in the file, so that its 90 degrees may be a little less than pi / 2.
constexpr double rounding = 1e-6;

// A file with more azimuths of the light than this is anisotropic.
constexpr std::size_t isotropic_azimuths = 2;

double elevation(const Vector3& direction) {
  return std::atan2(direction.head<2>().norm(), direction.z());
}

double azimuth(const Vector3& direction) { return std::atan2(direction.y(), direction.x()); }

double coordinate_of_elevation(double theta) { return std::sqrt(theta * (2 / pi)); }

double coordinate_of_azimuth(double phi) {
  const double turns = (phi + pi) / (2 * pi);
  return turns - std::floor(turns);
}

// A field of one dimension whose values rise.
std::vector<float> read_axis(const TensorFile& file, const std::string& name) {
  file.shape_of_floats(name, 1);
  std::vector<float> values = file.floats(name);
  // Sorted by "less or equal" is sorted without equal neighbours.
  if (!std::is_sorted(values.begin(), values.end(), std::less_equal<>())) {
    file.file().fail("expected rising values in field '" + name + "', found others.");
  }
  return values;
}

std::vector<float> read_elevations(const TensorFile& file) {
  std::vector<float> values = read_axis(file, "theta_i");
  if (values.size() < 2 || values.front() < 0 || values.back() > pi / 2 + rounding) {
    file.file().fail("expected two or more angles from 0 to pi / 2 in field 'theta_i', found " +
                     std::to_string(values.size()) + " from " + std::to_string(values.front()) +
                     " to " + std::to_string(values.back()) + ".");
  }
  return values;
}

// The columns and rows of a field of grids, its last two dimensions.
std::array<std::size_t, 2> grid_size(const TensorFile& file, const std::string& name,
                                     std::size_t dimensions) {
  const Shape& shape = file.shape_of_floats(name, dimensions);
  const std::size_t columns = shape[dimensions - 1], rows = shape[dimensions - 2];
  if (columns < 2 || rows < 2) {
    file.file().fail("expected grids of 2 x 2 points or more in field '" + name + "', found " +
                     std::to_string(rows) + " x " + std::to_string(columns) + ".");
  }
  return {columns, rows};
}

// `count` tables of a density each.
std::vector<float> read_densities(const TensorFile& file, const std::string& name,
                                  std::size_t count) {
  std::vector<float> values = file.floats(name);
  const std::size_t size = values.size() / count;
  for (std::size_t first = 0; first < values.size(); first += size) {
    const auto table = std::span(values).subspan(first, size);
    const auto [least, most] = std::minmax_element(table.begin(), table.end());
    if (*least < 0 || *most == 0) {
      file.file().fail("expected densities in field '" + name + "', found " +
                       (*least < 0 ? "one below zero." : "nothing but zeros."));
    }
  }
  return values;
}

std::vector<Rgb> read_weights(const TensorFile& file) {
  constexpr float shortest = 400, longest = 700;
  const std::vector<float> wavelengths = read_axis(file, "wavelengths");
  if (wavelengths.front() > shortest || wavelengths.back() < longest) {
    file.file().fail("expected wavelengths from 400 to 700 nm in field 'wavelengths', found " +
                     std::to_string(wavelengths.front()) + " to " +
                     std::to_string(wavelengths.back()) + ".");
  }
  return rgb_weights(wavelengths);
}

// How far the light's azimuths go is how much of a turn the surface looks different in: a whole
// one, half of one, or a quarter, which its mirror images complete. Returns 1, 2 or 4.
int parts_of_a_turn(const TensorFile& file, std::span<const float> phi_i) {
  const double parts = std::round(2 * pi / (phi_i.back() - phi_i.front()));
  if (parts != 1 && parts != 2 && parts != 4) {
    file.file().fail("expected azimuths over 360, 180 or 90 degrees in field 'phi_i', found " +
                     std::to_string(degrees(phi_i.back() - phi_i.front())) + ".");
  }
  return static_cast<int>(parts);
}

// The numbers of azimuths and elevations of the light, for each pair of which there are tables.
Shape tables_of(const TensorFile& file) {
  return {file.shape_of_floats("phi_i", 1)[0], file.shape_of_floats("theta_i", 1)[0]};
}

}  // namespace

Rgl::Grids Rgl::read_grid(const TensorFile& file, const std::string& name) {
  const auto [columns, rows] = grid_size(file, name, 2);
  return {columns, rows, read_densities(file, name, 1)};
}

std::vector<Rgl::Azimuth> Rgl::read_azimuths(const TensorFile& file, std::size_t elevations) {
  const std::vector<float> phi_i = read_axis(file, "phi_i");
  std::vector<Azimuth> azimuths;
  if (phi_i.size() <= isotropic_azimuths) {
    const double weight = 1.0 / static_cast<double>(phi_i.size());
    for (std::size_t i = 0; i < phi_i.size(); ++i) {
      azimuths.push_back({i * elevations, phi_i[i], 0, 1, weight});
    }
    return azimuths;
  }
  const bool mirrored = parts_of_a_turn(file, phi_i) == 4;
  for (std::size_t i = 0; i < phi_i.size(); ++i) {
    // The trapezoid rule.
    const double step = phi_i[std::min(i + 1, phi_i.size() - 1)] - phi_i[i == 0 ? 0 : i - 1];
    const double weight = step / 2 / (phi_i.back() - phi_i.front());
    for (const double sign : {1.0, -1.0}) {
      if (sign < 0 && !mirrored) continue;
      azimuths.push_back(
          {i * elevations, phi_i[i], phi_i[i], sign, mirrored ? weight / 2 : weight});
    }
  }
  return azimuths;
}

DensityWarp Rgl::read_visible_normals(const TensorFile& file, const Shape& tables) {
  const auto [columns, rows] = grid_size(file, "vndf", 4);
  file.expect_floats("vndf", {tables[0], tables[1], rows, columns});
  return {read_densities(file, "vndf", tables[0] * tables[1]), columns, rows};
}

Rgl::Grids Rgl::read_colours(const TensorFile& file, const Shape& tables) {
  const bool in_rgb = file.has("rgb");
  const std::string name = in_rgb ? "rgb" : "spectra";
  const auto [columns, rows] = grid_size(file, name, 5);
  const std::vector<Rgb> weights =
      in_rgb ? std::vector<Rgb>{Rgb(1, 0, 0), Rgb(0, 1, 0), Rgb(0, 0, 1)} : read_weights(file);
  file.expect_floats(name, {tables[0], tables[1], weights.size(), rows, columns});
  const std::size_t size = columns * rows, count = tables[0] * tables[1];
  Grids colours{columns, rows, std::vector<float>(count * 3 * size)};
  for (std::size_t table = 0; table < count; ++table) {
    // All spectra of a file may be many times larger than their colours.
    const std::vector<float> spectra =
        file.floats(name, table * weights.size() * size, weights.size() * size);
    for (std::size_t i = 0; i < size; ++i) {
      Rgb colour = Rgb::Zero();
      for (std::size_t w = 0; w < weights.size(); ++w) {
        colour += weights[w] * spectra[w * size + i];
      }
      for (std::size_t c = 0; c < 3; ++c) {
        colours.values[(table * 3 + c) * size + i] = static_cast<float>(colour[c]);
      }
    }
  }
  return colours;
}

Rgl::Rgl(const InputFile& file) : Rgl(TensorFile(file)) {}

Rgl::Rgl(const TensorFile& file)
    : theta_i_(read_elevations(file)),
      isotropic_(tables_of(file)[0] <= isotropic_azimuths),
      azimuths_(read_azimuths(file, theta_i_.size())),
      normals_(read_grid(file, "ndf")),
      area_(read_grid(file, "sigma")),
      visible_normals_(read_visible_normals(file, tables_of(file))),
      colours_(read_colours(file, tables_of(file))),
      scaled_(file.first_byte("jacobian") != 0) {}

Mixture Rgl::elevations_around(double theta_i) const {
  const auto above = std::upper_bound(theta_i_.begin() + 1, theta_i_.end() - 1, theta_i);
  const auto second = static_cast<std::size_t>(above - theta_i_.begin());
  const double low = theta_i_[second - 1], high = theta_i_[second];
  return {{second - 1, second}, std::clamp((theta_i - low) / (high - low), 0.0, 1.0)};
}

Rgb Rgl::evaluate(const Azimuth& light, const Mixture& elevations, const Angles& angles) const {
  const Mixture tables{{light.first + elevations.table[0], light.first + elevations.table[1]},
                       elevations.share};
  const double y_m = coordinate_of_azimuth(light.origin + light.sign * angles.turn);
  const auto [x, y] = visible_normals_.flatten(angles.x_m, y_m, tables);
  const GridCell cell(x, y, colours_.columns, colours_.rows);
  Rgb colour = Rgb::Zero();
  for (std::size_t i = 0; i < 2; ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      colour[static_cast<Eigen::Index>(c)] +=
          tables.weight(i) * cell.interpolate(colours_.grid(3 * tables.table[i] + c));
    }
  }
  if (!scaled_) return colour;
  const GridCell of_normal(angles.x_m, y_m, normals_.columns, normals_.rows);
  const GridCell of_light(angles.x_i, coordinate_of_azimuth(light.light), area_.columns,
                          area_.rows);
  return colour *
         (of_normal.interpolate(normals_.grid(0)) / (4 * of_light.interpolate(area_.grid(0))));
}

Rgb Rgl::evaluate(const Vector3& wi, const Half& half) const {
  const double theta_i = elevation(wi);
  if (theta_i < theta_i_.front() - rounding || theta_i > theta_i_.back() + rounding) return unknown;
  const Angles angles{coordinate_of_elevation(theta_i), half.x, half.phi - azimuth(wi)};
  const Mixture elevations = elevations_around(theta_i);
  Rgb mean = Rgb::Zero();
  for (const Azimuth& light : azimuths_) mean += light.weight * evaluate(light, elevations, angles);
  return mean;
}

Rgl::Half Rgl::half_between(const Vector3& wi, const Vector3& wo) {
  const Vector3 half = wi + wo;
  return {coordinate_of_elevation(elevation(half)), azimuth(half)};
}

Rgb Rgl::evaluate(const Vector3& wi, const Vector3& wo) const {
  if (!(wi.z() > 0 && wo.z() > 0)) return unknown;
  return evaluate(wi, half_between(wi, wo));
}

Rgb Rgl::reflectance(const Vector3& wi, const Vector3& wo) const {
  if (!(wi.z() > 0 && wo.z() > 0)) return unknown;
  const Half half = half_between(wi, wo);
  Rgb total = Rgb::Zero();
  double cosines = 0;
  for (const auto& [light, viewer] : {std::pair{wi, wo}, std::pair{wo, wi}}) {
    const Rgb value = evaluate(light, half);
    if (value.isNaN().any()) continue;
    total += value;
    cosines += viewer.z();
  }
  return cosines > 0 ? Rgb((total / cosines).max(0.0)) : unknown;
}

Measurement read_rgl(const InputFile& file, int threads) {
  const Rgl rgl(file);
  TableSource source{"RGL", {}};
  if (!rgl.isotropic()) {
    source.warnings.emplace_back(
        "the surface is anisotropic: its mean over all turns about the normal is taken");
  }
  const Measurement::FillRows fill = [&](int h, const Measurement::Rows& rows) {
    for (int i = 0; i < Measurement::row_size; ++i) {
      const auto [wi, wo] = to_directions(
          Measurement::centre(h, i / Measurement::phi_d_bins, i % Measurement::phi_d_bins));
      const Rgb value = rgl.reflectance(wi, wo);
      for (int c = 0; c < 3; ++c) rows[static_cast<std::size_t>(c)][i] = value[c];
    }
  };
  return Measurement(fill, threads, std::move(source));
}

}  // namespace lobefit
