#include "measurement/tensor_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "measurement/input_error.h"
#include "measurement/read_measurement.h"
#include "measurement/rgl.h"
#include "rgl_file.h"

namespace lobefit {
namespace {

namespace fs = std::filesystem;

class TensorFiles : public ::testing::Test {
 protected:
  TensorFiles()
      : path_(fs::temp_directory_path() /
              ("lobefit_" +
               std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()) +
               ".bsdf")) {}
  ~TensorFiles() override { fs::remove(path_); }

  const fs::path& write(const std::string& bytes) const {
    std::ofstream(path_, std::ios::binary) << bytes;
    return path_;
  }

  // What is wrong with a file of these bytes; empty when all of it could be read. Anything but one
  // sentence that names the file fails the test.
  std::string complaint(const std::string& bytes) const {
    try {
      // The table, which always takes its time, says nothing more.
      if (TensorFile::recognises(InputFile(write(bytes)))) {
        const Rgl rgl{InputFile(path_)};
      } else {
        read_measurement(path_);
      }
    } catch (const InputError& error) {
      std::string said = error.what();
      EXPECT_EQ(said.find(path_.string() + ": expected "), 0u) << said;
      EXPECT_TRUE(said.back() == '.' || said.back() == '?') << said;
      EXPECT_EQ(said.find_first_of("\n\r"), std::string::npos) << said;
      return said;
    }
    return "";
  }

  void expect(const std::string& bytes, const std::string& part) const {
    EXPECT_NE(complaint(bytes).find(part), std::string::npos) << complaint(bytes);
  }

 private:
  fs::path path_;
};

std::vector<TensorField> small_fields() {
  return rgl_fields(matte_surface(Rgb(0.5, 0.4, 0.3)),
                    {.elevations = 3, .normals = 4, .directions = 4});
}

// Up to the shape of the last field, which is of one dimension.
std::size_t head_size(const std::string& whole) {
  return whole.rfind("jacobian") + std::strlen("jacobian") + 2 + 1 + 8 + 8;
}

TensorField& field(std::vector<TensorField>& fields, const std::string& name) {
  return *std::find_if(fields.begin(), fields.end(), [&](auto& f) { return f.name == name; });
}

// A file in which one field was changed.
std::string with(const std::string& name, const std::function<void(TensorField&)>& change) {
  std::vector<TensorField> fields = small_fields();
  change(field(fields, name));
  return tensor_file(fields);
}

std::string with_value(const std::string& name, std::size_t at, float value) {
  return with(name, [=](TensorField& f) {
    std::memcpy(f.bytes.data() + at * sizeof(float), &value, sizeof(value));
  });
}

std::string with_shape(const std::string& name, const std::vector<std::uint64_t>& shape) {
  return with(name, [=](TensorField& f) { f.shape = shape; });
}

TEST_F(TensorFiles, ASmallFileIsRead) { EXPECT_EQ(complaint(tensor_file(small_fields())), ""); }

TEST_F(TensorFiles, EveryCutIsSeen) {
  const std::string whole = tensor_file(small_fields());
  for (std::size_t bytes = 0; bytes < whole.size(); bytes += bytes < head_size(whole) ? 1 : 29) {
    ASSERT_NE(complaint(whole.substr(0, bytes)), "") << bytes << " of " << whole.size();
  }
  ASSERT_NE(complaint(whole.substr(0, whole.size() - 1)), "");
}

// The name of a field that is not read may be any.
TEST_F(TensorFiles, EveryWrongByteOfTheHeadIsSeenOrHarmless) {
  const std::string whole = tensor_file(small_fields());
  const Vector3 wi = Vector3(0.3, 0.2, 0.7).normalized(), wo = Vector3(0, -0.1, 0.8).normalized();
  const Rgb right = Rgl(InputFile(write(whole))).evaluate(wi, wo);
  for (std::size_t at = 0; at < head_size(whole); ++at) {
    for (const int flip : {0x01, 0x80, 0xff}) {
      std::string damaged = whole;
      damaged[at] = static_cast<char>(damaged[at] ^ flip);
      if (complaint(damaged).empty()) {
        ASSERT_TRUE((Rgl(InputFile(write(damaged))).evaluate(wi, wo) == right).all()) << at;
      }
    }
  }
}

TEST_F(TensorFiles, ClaimsOfSizesAreNotBelieved) {
  constexpr std::uint64_t most = std::numeric_limits<std::uint64_t>::max();
  std::string twenty("tensor_file\0\1\0\xff\xff\xff\xff\xff\xff", 20);
  expect(twenty, "found 20 bytes, in which its head does not end");
  expect(with_shape("vndf", {1, 3, std::uint64_t{1} << 20, std::uint64_t{1} << 20}),
         "found the end of the file");
  expect(with_shape("vndf", {most, most, most, most}), "found the end of the file");
  // Their product is 2^64, which is 0 in 64 bits.
  expect(with_shape("rgb", {1, std::uint64_t{1} << 32, std::uint64_t{1} << 32, 1, 1}),
         "found the end of the file");
  expect(with_shape("ndf", std::vector<std::uint64_t>(65535, 1)),
         "expected values in 2 dimensions");
  std::string beyond = tensor_file(small_fields());
  const std::size_t offset = beyond.find("ndf") + 3 + 2 + 1;
  std::memset(beyond.data() + offset, 0xff, sizeof(std::uint64_t));
  expect(beyond, "found the end of the file");
  std::string shifted = tensor_file(small_fields());
  shifted[offset] = static_cast<char>(shifted[offset] + 4);
  expect(shifted, "where there are others");
}

TEST_F(TensorFiles, SaysWhatIsWrong) {
  const std::string whole = tensor_file(small_fields());
  std::string other = whole;
  other[12] = 2;
  expect(other, "expected a tensor file of version 1.0, found version 2.0.");
  other = whole;
  other[11] = '!';
  expect(other, "is this another format?");
  for (const char* name : {"phi_i", "theta_i", "ndf", "sigma", "vndf", "jacobian"}) {
    expect(with(name, [](TensorField& f) { f.name = "other"; }),
           "found no field '" + std::string(name) + "'.");
  }
  expect(with("rgb", [](TensorField& f) { f.name = "other"; }), "found no field 'spectra'.");
  expect(with("rgb", [](TensorField& f) { f.name = "ndf"; }),
         "expected one field 'ndf', found two");
  expect(with("ndf", [](TensorField& f) { f.type = 5; }),
         "expected values of float32 in field 'ndf', found uint32.");
  expect(with("ndf", [](TensorField& f) { f.type = 12; }), "expected a type of 1 to 11");
  expect(with_shape("ndf", {16}), "expected values in 2 dimensions in field 'ndf', found 16.");
  expect(with_shape("ndf", {0, 16}), "in field 'ndf', found 0 x 16.");
  expect(with_shape("sigma", {1, 16}), "expected grids of 2 x 2 points or more in field 'sigma'");
  expect(with_shape("vndf", {3, 1, 4, 4}),
         "expected 1 x 3 x 4 x 4 values in field 'vndf', found 3 x 1 x 4 x 4.");
  expect(with_shape("rgb", {1, 3, 4, 3, 4}), "expected 1 x 3 x 3 x 3 x 4 values in field 'rgb'");
  expect(with_shape("jacobian", {0}), "expected a value in field 'jacobian', found none.");
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const char* name : {"phi_i", "theta_i", "ndf", "sigma", "vndf", "rgb"}) {
    expect(with_value(name, 0, nan), "expected finite numbers in field '" + std::string(name));
  }
  expect(with_value("rgb", 7, std::numeric_limits<float>::infinity()), "expected finite numbers");
  expect(with_value("theta_i", 1, 2), "expected rising values in field 'theta_i'");
  expect(with_value("theta_i", 2, 2), "expected two or more angles from 0 to pi / 2");
  expect(with_value("theta_i", 0, -1), "expected two or more angles from 0 to pi / 2");
  expect(with_value("vndf", 20, -1), "in field 'vndf', found one below zero.");
  expect(with("ndf", [](TensorField& f) { f.bytes.assign(f.bytes.size(), 0); }),
         "in field 'ndf', found nothing but zeros.");
  expect("", "found an empty file");
}

TEST_F(TensorFiles, OtherFormatsOfTheSuffixAreNamed) {
  // How files of RPC Photonics for Zemax begin, and those of LightTools.
  expect("Source  Measured\r\nSymmetry  PlaneSymmetrical\r\nSpectralContent  Monochrome\r\n",
         "found text; the BSDF formats of Zemax, LightTools and other programs are not read.");
  expect("# BSDF data\nScatterType BRDF\n",
         "expected a MERL table (*.binary) or an RGL measurement");
  expect(std::string("\xff\xfeS\0o\0u\0r\0c\0e\0", 14), "found text");
}

}  // namespace
}  // namespace lobefit
