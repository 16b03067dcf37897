// The container of RGL files: named arrays of numbers in one file.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "measurement/input_file.h"

namespace lobefit {

// A "tensor file" of version 1.0: the 12 bytes "tensor_file\0", two bytes of version, the number of
// fields (uint32), then for each field the length of its name (uint16), the name, the number of
// dimensions (uint16), the type (a byte), the place of its values in the file (uint64) and its
// shape (uint64 each). Everything is little-endian, the last dimension runs fastest. No size that
// the file states is believed: all are held against that of the file before memory is asked for.
class TensorFile {
 public:
  using Shape = std::vector<std::size_t>;

  // Whether the file begins like one, or is the beginning of its beginning.
  static bool recognises(const InputFile& file);

  // Reads the head. Throws InputError for another version, a head or values that go beyond the end
  // of the file, values in one place with others, an unknown type and a name that comes twice. The
  // file must outlive this.
  explicit TensorFile(const InputFile& file);

  bool has(const std::string& name) const { return fields_.contains(name); }

  // The shape of a field of float32 of so many dimensions, none of them empty. Throws InputError
  // for a field that is missing, of another type or of another shape.
  const Shape& shape_of_floats(const std::string& name, std::size_t dimensions) const;

  // Throws InputError unless the field of float32 has this shape.
  void expect_floats(const std::string& name, const Shape& shape) const;

  // The values of a field of float32 from the first-th on. Throws InputError for values that are
  // infinite or no numbers.
  std::vector<float> floats(const std::string& name, std::size_t first, std::size_t count) const;
  std::vector<float> floats(const std::string& name) const;

  // The first value of a field of uint8; throws InputError where there is none.
  std::uint8_t first_byte(const std::string& name) const;

  const InputFile& file() const { return file_; }

 private:
  struct Field {
    std::uint8_t type = 0;
    std::uint64_t offset = 0;
    Shape shape;
    std::size_t count = 0;  // of values

    std::uint64_t end() const;
  };
  class Head;

  void expect_apart(std::uint64_t end_of_head) const;
  const Field& field(const std::string& name, std::uint8_t type) const;

  const InputFile& file_;
  std::map<std::string, Field> fields_;
};

}  // namespace lobefit
