#include "measurement/merl.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "measurement/input_error.h"
#include "measurement/input_file.h"
#include "measurement/read_measurement.h"
#include "reflectance/abc.h"

namespace lobefit {
namespace {

namespace fs = std::filesystem;
constexpr std::uintmax_t merl_bytes = 34992012;

class Merl : public ::testing::Test {
 protected:
  Merl() {
    folder_ = fs::temp_directory_path() /
              ("lobefit_merl_" +
               std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::create_directories(folder_);
  }
  ~Merl() override { fs::remove_all(folder_); }

  fs::path path(const std::string& name = "table.binary") const { return folder_ / name; }

  // A file of these dimensions with `count` values.
  fs::path file(const std::vector<std::int32_t>& dimensions, std::size_t count,
                double value = 0.5) const {
    std::ofstream out(path(), std::ios::binary);
    out.write(reinterpret_cast<const char*>(dimensions.data()),
              static_cast<std::streamsize>(dimensions.size() * sizeof(std::int32_t)));
    const std::vector<double> values(count, value);
    out.write(reinterpret_cast<const char*>(values.data()),
              static_cast<std::streamsize>(count * sizeof(double)));
    return path();
  }

  // Flips bits of the byte at a place of the file, and returns what it was.
  char patch(std::streamoff at, int bits) const {
    std::fstream both(path(), std::ios::binary | std::ios::in | std::ios::out);
    const char was = static_cast<char>(both.seekg(at).get());
    both.seekp(at).put(static_cast<char>(was ^ bits));
    return was;
  }

  static std::string sentence(const fs::path& path) {
    try {
      read_measurement(path);
    } catch (const InputError& error) {
      return error.what();
    }
    return "read without complaint";
  }

 private:
  fs::path folder_;
};

constexpr std::size_t full = 3 * static_cast<std::size_t>(Measurement::bin_count);

TEST_F(Merl, ReadsWhatItWrites) {
  const Measurement sample = sample_measurement("nickel");
  write_merl(sample, path());
  EXPECT_EQ(fs::file_size(path()), merl_bytes);
  const Measurement read = read_measurement(path());
  EXPECT_EQ(read.bins().valid, sample.bins().valid);
  EXPECT_EQ(read.bins().below_horizon, sample.bins().below_horizon);
  EXPECT_EQ(read.bins().negative, 0);
  for (std::size_t i = 0; i < full; i += 101) {
    if (std::isnan(sample.planes()[i])) {
      EXPECT_TRUE(std::isnan(read.planes()[i]));
    } else {
      // One division and one multiplication by the channel's scale lie between.
      EXPECT_NEAR(read.planes()[i], sample.planes()[i], 1e-15 * sample.planes()[i]);
    }
  }
}

TEST_F(Merl, LeavesNothingBesideTheFileItWrites) {
  write_merl(sample_measurement("nickel"), path());
  EXPECT_EQ(std::distance(fs::directory_iterator(path().parent_path()), fs::directory_iterator()),
            1);
}

TEST_F(Merl, NamesAFolderThatCannotBeWrittenTo) {
  EXPECT_THROW(write_merl(sample_measurement("nickel"), path("missing/table.binary")), InputError);
}

TEST_F(Merl, ScalesTheChannels) {
  const Measurement read = read_measurement(file({90, 90, 180}, full, 1500));
  const Rgb value = read.bin(3, 4, 5);
  EXPECT_DOUBLE_EQ(value[0], 1.0);
  EXPECT_DOUBLE_EQ(value[1], 1.15);
  EXPECT_DOUBLE_EQ(value[2], 1.66);
}

TEST_F(Merl, AveragesTheHalvesOf360Steps) {
  std::ofstream out(path(), std::ios::binary);
  const std::int32_t dimensions[] = {90, 90, 360};
  out.write(reinterpret_cast<const char*>(dimensions), sizeof(dimensions));
  std::vector<double> row(360, 1500);
  std::fill(row.begin() + 180, row.end(), 4500);
  row[181] = -1;  // only its twin at 1 is usable
  for (int i = 0; i < 3 * 90 * 90; ++i) {
    out.write(reinterpret_cast<const char*>(row.data()), 360 * sizeof(double));
  }
  out.close();
  const Measurement read = read_measurement(path());
  EXPECT_DOUBLE_EQ(read.bin(2, 2, 0)[0], 2.0);
  EXPECT_DOUBLE_EQ(read.bin(2, 2, 1)[0], 1.0);
}

TEST_F(Merl, CountsInvalidBinsByKind) {
  Measurement sample = sample_measurement("nickel");
  std::vector<double> planes(sample.planes().begin(), sample.planes().end());
  planes[static_cast<std::size_t>(Measurement::index(0, 0, 0))] = -0.1;
  planes[static_cast<std::size_t>(Measurement::index(0, 0, 1))] =
      std::numeric_limits<double>::infinity();
  const Measurement damaged(std::move(planes));
  EXPECT_EQ(damaged.bins().negative, 1);
  EXPECT_EQ(damaged.bins().non_finite, 1);
  EXPECT_EQ(damaged.bins().valid, sample.bins().valid - 2);
  EXPECT_TRUE(std::isnan(damaged.bin(0, 0, 0)[2]));
}

TEST_F(Merl, SaysWhatIsWrongWithAFile) {
  const auto expect = [&](const fs::path& at, const std::string& part) {
    const std::string said = sentence(at);
    EXPECT_NE(said.find(part), std::string::npos) << said;
    EXPECT_EQ(said.find(at.string()), 0u) << said;
    EXPECT_EQ(said.find('\n'), std::string::npos);
  };
  expect(path("nothing.binary"), "found no such file");
  fs::create_directory(path("folder.binary"));
  expect(path("folder.binary"), "found a folder");
  expect(file({}, 0), "found an empty file");
  expect(file({90, 90}, 0), "found 8 bytes");
  expect(file({90, 90, 180}, full - 1), "found 34,992,004; was the file cut off");
  expect(file({90, 90, 180}, full + 1), "found 34,992,020; there is something behind");
  expect(file({90, 180, 90}, full), "theta_d = 180, phi_d = 90");
  expect(file({-90, -90, 180}, full), "theta_h = -90, theta_d = -90");
  expect(file({0x5a000000, 0x5a000000, static_cast<std::int32_t>(0xb4000000)}, full), "big-endian");
  expect(file({90, 90, 180}, full, -1), "found no valid bin (1,096,216 negative");
  expect(file({90, 90, 180}, full, std::nan("")), "no valid bin (0 negative, 1,096,216 not finite");
  std::ofstream(path()) << "diffuse 0.1 0.2 0.3";
  expect(path(), "found text");
}

TEST_F(Merl, EveryWrongByteOfTheHeadIsSeen) {
  fs::resize_file(file({90, 90, 180}, 0), merl_bytes);
  for (std::streamoff at = 0; at < 12; ++at) {
    for (const int flip : {0x01, 0x10, 0x80, 0xff}) {
      const char right = patch(at, flip);
      EXPECT_NE(sentence(path()).find("expected a MERL table"), std::string::npos) << at;
      EXPECT_EQ(patch(at, flip), static_cast<char>(right ^ flip));
    }
  }
  EXPECT_EQ(sentence(path()), "read without complaint");
}

// Zeros are valid; what ones make of them is no number, in whichever bin and plane.
TEST_F(Merl, DamageSlidingOverTheValuesCostsTheBinsItMeets) {
  fs::resize_file(file({90, 90, 180}, 0), merl_bytes);
  const int valid = read_measurement(path()).bins().valid;
  constexpr std::streamoff step =
      4999999;  // a prime, so that values are met at each of their bytes
  for (std::streamoff at = 12; at + 8 < static_cast<std::streamoff>(merl_bytes); at += step) {
    for (int byte = 0; byte < 8; ++byte) patch(at + byte, 0xff);
    const BinCounts bins = read_measurement(path()).bins();
    // Eight bytes meet two values at most; some bins are below the horizon anyway.
    EXPECT_GE(bins.valid, valid - 2) << at;
    EXPECT_EQ(bins.valid + bins.non_finite + bins.negative, valid) << at;
    for (int byte = 0; byte < 8; ++byte) patch(at + byte, 0xff);
  }
  EXPECT_EQ(read_measurement(path()).bins().valid, valid);
}

TEST_F(Merl, RefusesEveryShorterHead) {
  for (std::size_t bytes = 0; bytes < 12; ++bytes) {
    std::ofstream(path(), std::ios::binary) << std::string(bytes, 'Z');
    EXPECT_NE(sentence(path()).find("expected a MERL table"), std::string::npos);
  }
}

TEST_F(Merl, AFileThatIsCutWhileItIsReadIsNamed) {
  const InputFile open(file({90, 90, 180}, 100));
  fs::resize_file(path(), 400);
  std::vector<double> values(50);
  open.read(12, values.data(), 48 * sizeof(double));
  try {
    open.read(12, values.data(), 49 * sizeof(double));
    FAIL() << "read without complaint";
  } catch (const InputError& error) {
    EXPECT_EQ(error.what(), path().string() +
                                ": expected 812 bytes, found its end earlier; did the file change "
                                "while it was read?");
  }
}

TEST_F(Merl, WhatIsNoFileIsNamed) {
  EXPECT_NE(sentence("/dev/null").find("found something that is not a file"), std::string::npos);
}

}  // namespace
}  // namespace lobefit
