#include "measurement/rgl.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "measurement/half_difference.h"
#include "measurement/input_error.h"
#include "measurement/read_measurement.h"
#include "measurement/spectrum.h"
#include "rgl_file.h"

namespace lobefit {
namespace {

namespace fs = std::filesystem;

// A file of these fields while it is in scope.
class RglFile {
 public:
  explicit RglFile(const std::vector<TensorField>& fields)
      : path_(fs::temp_directory_path() /
              ("lobefit_rgl_" +
               std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()))) {
    std::ofstream(path_, std::ios::binary) << tensor_file(fields);
  }
  RglFile(const RglFile&) = delete;
  RglFile& operator=(const RglFile&) = delete;
  ~RglFile() { fs::remove(path_); }

  Rgl rgl() const { return Rgl(InputFile(path_)); }
  Measurement measurement(int threads = 0) const { return read_measurement(path_, threads); }

 private:
  fs::path path_;
};

Vector3 direction(double theta, double phi) {
  return {std::sin(radians(theta)) * std::cos(radians(phi)),
          std::sin(radians(theta)) * std::sin(radians(phi)), std::cos(radians(theta))};
}

struct Pair {
  Vector3 wi, wo;
};

// Light and viewer up to `most` degrees from the normal, at all angles about it.
std::vector<Pair> pairs(double most) {
  std::vector<Pair> all;
  for (double theta_i = 2; theta_i < most; theta_i += 6.7) {
    for (double theta_o = 3; theta_o < most; theta_o += 7.3) {
      for (double phi = 5; phi < 360; phi += 23) {
        all.push_back({direction(theta_i, 17 * theta_o), direction(theta_o, 17 * theta_o + phi)});
      }
    }
  }
  return all;
}

double relative(double found, double expected) { return std::abs(found / expected - 1); }

const Rgb albedo(0.6, 0.3, 0.1);

TEST(RglMeasurement, AMatteSurfaceIsMatteInEveryBin) {
  const RglFile file(
      rgl_fields(matte_surface(albedo), {.elevations = 24, .normals = 4, .directions = 96}));
  const Measurement table = file.measurement();
  EXPECT_EQ(table.source().format, "RGL");
  EXPECT_TRUE(table.source().warnings.empty());
  const BinCounts bins = table.bins();
  EXPECT_EQ(bins.valid + bins.below_horizon, Measurement::bin_count);
  const BinCentres& t = bin_centres();
  for (int h = 0; h < Measurement::theta_h_bins; ++h) {
    for (int d = 0; d < Measurement::theta_d_bins; ++d) {
      for (int p = 0; p < Measurement::phi_d_bins; ++p) {
        if (!table.valid(h, d, p)) continue;
        // Between the points of its table, a file with f cos(theta_o) is off by up to 1/8 of the
        // cosine's curvature: .0022 where elevations of the light are .13 apart, .001 for 96 x 96
        // directions. The mean of the two cosines is cos(theta_h) cos(theta_d).
        const double tolerance = 0.0032 / (t.cos_h[h] * t.cos_d[d]);
        for (int c = 0; c < 3; ++c) {
          ASSERT_LT(relative(table.bin(h, d, p)[c], albedo[c] / pi), tolerance)
              << h << " " << d << " " << p;
        }
      }
    }
  }
}

TEST(RglMeasurement, FacetsAreThoseOfTheFormula) {
  constexpr double roughness = 0.3;
  const RglFile file(rgl_fields(ggx_surface(roughness), {}));
  const Rgl rgl = file.rgl();
  EXPECT_TRUE(rgl.isotropic());
  for (const auto& [wi, wo] : pairs(75)) {
    const double expected = ggx_reflectance(roughness, wi, wo);
    // 96 x 96 normals and 12 elevations: a file is no closer to what was measured.
    EXPECT_LT(relative(rgl.evaluate(wi, wo)[1] / wo.z(), expected), 0.03);
    EXPECT_LT(relative(rgl.reflectance(wi, wo)[1], expected), 0.03);
  }
}

TEST(RglMeasurement, IsReciprocal) {
  const Rgl rgl = RglFile(rgl_fields(ggx_surface(0.2), {.elevations = 5, .normals = 32})).rgl();
  for (const auto& [wi, wo] : pairs(90)) {
    const Rgb there = rgl.reflectance(wi, wo), back = rgl.reflectance(wo, wi);
    EXPECT_TRUE((there == back).all());
    EXPECT_TRUE((there >= 0).all() && there.isFinite().all());
  }
}

TEST(RglMeasurement, TheTableIsThatOfTheFunction) {
  const RglFile file(rgl_fields(ggx_surface(0.4), {.elevations = 5, .normals = 32}));
  const Rgl rgl = file.rgl();
  const Measurement one = file.measurement(1), two = file.measurement(2);
  for (const auto& [h, d, p] : {std::array{0, 0, 0}, {10, 40, 30}, {40, 20, 150}, {80, 3, 90}}) {
    const auto [wi, wo] = to_directions(Measurement::centre(h, d, p));
    EXPECT_TRUE((one.bin(h, d, p) == rgl.reflectance(wi, wo)).all());
  }
  EXPECT_EQ(std::memcmp(one.planes().data(), two.planes().data(), one.planes().size_bytes()), 0);
}

TEST(RglMeasurement, WhatWasNotMeasuredIsInvalid) {
  const SurfaceGrid grid{.elevations = 4, .first = 10, .last = 80, .normals = 4};
  const Rgl rgl = RglFile(rgl_fields(matte_surface(albedo), grid)).rgl();
  const Vector3 low = direction(85, 0), middle = direction(40, 90), high = direction(5, 30);
  EXPECT_TRUE(rgl.evaluate(low, middle).isNaN().all());
  EXPECT_TRUE(rgl.evaluate(high, middle).isNaN().all());
  EXPECT_TRUE(rgl.reflectance(low, high).isNaN().all());
  // The two interchanged were measured.
  EXPECT_NEAR(rgl.reflectance(low, middle)[0], rgl.evaluate(middle, low)[0] / low.z(), 1e-12);
  EXPECT_TRUE(rgl.evaluate(middle, direction(95, 0)).isNaN().all());
}

TEST(RglMeasurement, ColoursBeyondTheGamutAreClipped) {
  const Rgl rgl =
      RglFile(rgl_fields(matte_surface({0.5, -0.1, 0.2}), {.elevations = 3, .normals = 4})).rgl();
  const Vector3 wi = direction(20, 0), wo = direction(30, 120);
  EXPECT_LT(rgl.evaluate(wi, wo)[1], 0);
  EXPECT_EQ(rgl.reflectance(wi, wo)[1], 0);
  EXPECT_GT(rgl.reflectance(wi, wo)[2], 0);
}

std::vector<float> range(float first, float last, int count) {
  std::vector<float> values;
  values.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    values.push_back(first +
                     (last - first) * static_cast<float>(i) / static_cast<float>(count - 1));
  }
  return values;
}

// A matte surface of another albedo for every azimuth of the half vector, and with a part that
// changes its sign when light and viewer are mirrored.
Surface brushed_surface(double handedness) {
  Surface surface;
  surface.scaled = [=](const Vector3& wi, const Vector3& wo) {
    const Vector3 m = wi + wo;
    const double twice = 2 * std::atan2(m.y(), m.x());
    const double turn = wi.x() * wo.y() - wi.y() * wo.x();
    return Rgb(albedo / pi * wo.z() * (1 + 0.5 * std::cos(twice) + handedness * turn));
  };
  return surface;
}

double mean_of_brushed(double handedness, const Pair& pair) {
  const double turn = pair.wi.x() * pair.wo.y() - pair.wi.y() * pair.wo.x();
  return albedo[0] / pi * pair.wo.z() * (1 + handedness * turn);
}

TEST(RglMeasurement, AnAnisotropicSurfaceIsAveraged) {
  const auto half = static_cast<float>(-pi);
  // Over a whole turn, half of one, and a quarter, which stands for its mirror images.
  for (const auto& [last, handedness] :
       {std::pair{static_cast<float>(pi), 0.3}, {0.0f, 0.3}, {half / 2, 0.0}}) {
    const SurfaceGrid grid{
        .phi_i = range(half, last, 9), .elevations = 7, .normals = 4, .directions = 48};
    const RglFile file(rgl_fields(brushed_surface(handedness), grid));
    const Rgl rgl = file.rgl();
    EXPECT_FALSE(rgl.isotropic());
    double worst = 0;
    for (const Pair& pair : pairs(65)) {
      const double expected = mean_of_brushed(handedness, pair);
      worst = std::max(worst, relative(rgl.evaluate(pair.wi, pair.wo)[0], expected));
    }
    // 48 x 48 directions, as above; 1 + .5 cos turns twice in 48 of them.
    EXPECT_LT(worst, 0.04) << last;
  }
}

TEST(RglMeasurement, AnAnisotropicSurfaceIsWarnedOf) {
  const SurfaceGrid grid{.phi_i = range(static_cast<float>(-pi), 0, 3),
                         .elevations = 3,
                         .normals = 4,
                         .directions = 8};
  const Measurement table = RglFile(rgl_fields(brushed_surface(0), grid)).measurement();
  ASSERT_EQ(table.source().warnings.size(), 1u);
  EXPECT_NE(table.source().warnings[0].find("anisotropic"), std::string::npos);
}

TEST(RglMeasurement, OtherPartsOfATurnAreRefused) {
  const SurfaceGrid grid{
      .phi_i = range(0, 0.5f, 3), .elevations = 3, .normals = 4, .directions = 8};
  EXPECT_THROW(RglFile(rgl_fields(brushed_surface(0), grid)).rgl(), InputError);
}

TEST(RglMeasurement, SpectraBecomeColours) {
  const SurfaceGrid grid{.elevations = 5, .normals = 4, .directions = 32};
  std::vector<float> wavelengths;
  for (float w = 360; w <= 1000; w += 4) wavelengths.push_back(w);
  const Surface grey = matte_surface(Rgb::Constant(0.5));
  const Rgl in_rgb = RglFile(rgl_fields(grey, grid)).rgl();
  std::vector<TensorField> fields = rgl_fields(grey, grid, wavelengths);
  const Rgl spectral = RglFile(fields).rgl();

  // The same without all light from 600 nm on.
  Rgb kept = Rgb::Zero();
  const std::vector<Rgb> weights = rgb_weights(wavelengths);
  for (TensorField& field : fields) {
    if (field.name != "spectra") continue;
    const std::size_t plane = grid.directions * grid.directions;
    for (std::size_t i = 0; i < field.bytes.size() / sizeof(float); ++i) {
      if (wavelengths[i / plane % wavelengths.size()] < 600) continue;
      std::memset(field.bytes.data() + i * sizeof(float), 0, sizeof(float));
    }
  }
  for (std::size_t w = 0; wavelengths[w] < 600; ++w) kept += weights[w];
  const Rgl without_red = RglFile(fields).rgl();

  for (const auto& [wi, wo] : pairs(80)) {
    const Rgb expected = in_rgb.evaluate(wi, wo);
    // Colours are kept as float32.
    EXPECT_TRUE((spectral.evaluate(wi, wo) / expected).isApproxToConstant(1, 1e-5));
    EXPECT_TRUE((without_red.evaluate(wi, wo) / expected).isApprox(kept, 1e-5));
  }
}

TEST(RglMeasurement, SpectraThatAreNotOfAllVisibleLightAreRefused) {
  const SurfaceGrid grid{.elevations = 3, .normals = 4, .directions = 8};
  EXPECT_THROW(RglFile(rgl_fields(matte_surface(albedo), grid, {500, 600, 700})).rgl(), InputError);
}

}  // namespace
}  // namespace lobefit
