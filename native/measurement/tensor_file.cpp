#include "measurement/tensor_file.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

namespace lobefit {
namespace {

static_assert(std::endian::native == std::endian::little, "tensor files are read in place");

constexpr std::array<char, 12> magic = {'t', 'e', 'n', 's', 'o', 'r', '_', 'f', 'i', 'l', 'e', 0};
constexpr std::array<std::uint8_t, 2> version = {1, 0};

struct Type {
  const char* name;
  std::size_t bytes;
};
// By their number in a file.
constexpr std::array<Type, 12> types = {{{"no type", 0},
                                         {"uint8", 1},
                                         {"int8", 1},
                                         {"uint16", 2},
                                         {"int16", 2},
                                         {"uint32", 4},
                                         {"int32", 4},
                                         {"uint64", 8},
                                         {"int64", 8},
                                         {"float16", 2},
                                         {"float32", 4},
                                         {"float64", 8}}};
constexpr std::uint8_t uint8_type = 1, float32_type = 10;

std::string written(const TensorFile::Shape& shape) {
  std::string text;
  for (const std::size_t n : shape) text += (text.empty() ? "" : " x ") + std::to_string(n);
  return text.empty() ? "no dimension" : text;
}

}  // namespace

std::uint64_t TensorFile::Field::end() const { return offset + count * types[type].bytes; }

// Goes through the head of a file from its beginning.
class TensorFile::Head {
 public:
  explicit Head(const InputFile& file) : file_(file) {}

  template <typename Value>
  Value next() {
    Value value;
    take(&value, sizeof(value));
    return value;
  }

  std::string next_name() {
    std::string name(next<std::uint16_t>(), '\0');
    take(name.data(), name.size());
    // It may come to stand in a sentence.
    std::replace_if(
        name.begin(), name.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
    return name;
  }

  Field next_field(const std::string& name) {
    const auto dimensions = next<std::uint16_t>();
    Field field;
    field.type = next<std::uint8_t>();
    field.offset = next<std::uint64_t>();
    if (field.type == 0 || field.type >= types.size()) {
      file_.fail("expected a type of 1 to 11 in field '" + name + "', found " +
                 std::to_string(field.type) + ".");
    }
    // Not more dimensions than there are bytes for.
    expect_left(dimensions * sizeof(std::uint64_t));
    for (int i = 0; i < dimensions; ++i) field.shape.push_back(next<std::uint64_t>());
    field.count = count_of(name, field);
    return field;
  }

  std::uintmax_t place() const { return at_; }

 private:
  void expect_left(std::uintmax_t bytes) const {
    if (bytes <= file_.size() - at_) return;
    file_.fail("expected an RGL measurement, found " + with_commas(file_.size()) +
               " bytes, in which its head does not end; was the file cut off while it was copied?");
  }

  void take(void* to, std::size_t bytes) {
    expect_left(bytes);
    file_.read(at_, to, bytes);
    at_ += bytes;
  }

  // The number of values of a field, all of which lie in the file.
  std::size_t count_of(const std::string& name, const Field& field) const {
    const std::size_t bytes = types[field.type].bytes;
    const std::uintmax_t room =
        field.offset <= file_.size() ? (file_.size() - field.offset) / bytes : 0;
    if (std::find(field.shape.begin(), field.shape.end(), 0) != field.shape.end()) return 0;
    std::uintmax_t count = 1;
    for (const std::uintmax_t n : field.shape) {
      if (n > room / count) {
        file_.fail("expected " + written(field.shape) + " values of " + types[field.type].name +
                   " in field '" + name + "' from byte " + with_commas(field.offset) +
                   " on, found the end of the file at byte " + with_commas(file_.size()) +
                   "; was the file cut off while it was copied?");
      }
      count *= n;
    }
    return count;
  }

  const InputFile& file_;
  std::uintmax_t at_ = 0;
};

bool TensorFile::recognises(const InputFile& file) {
  std::array<char, magic.size()> found{};
  const auto bytes = static_cast<std::size_t>(std::min<std::uintmax_t>(file.size(), magic.size()));
  file.read(0, found.data(), bytes);
  return bytes > 0 && std::equal(found.begin(), found.begin() + bytes, magic.begin());
}

TensorFile::TensorFile(const InputFile& file) : file_(file) {
  Head head(file);
  if (head.next<std::array<char, magic.size()>>() != magic) {
    file.fail("expected a tensor file, found another beginning.");
  }
  const auto found = head.next<std::array<std::uint8_t, 2>>();
  if (found != version) {
    file.fail("expected a tensor file of version 1.0, found version " + std::to_string(found[0]) +
              "." + std::to_string(found[1]) + ".");
  }
  for (auto left = head.next<std::uint32_t>(); left > 0; --left) {
    const std::string name = head.next_name();
    if (!fields_.emplace(name, head.next_field(name)).second) {
      file.fail("expected one field '" + name + "', found two.");
    }
  }
  expect_apart(head.place());
}

// Where places are wrong, numbers would be read that mean something else.
void TensorFile::expect_apart(std::uint64_t end_of_head) const {
  std::vector<std::pair<std::string, Field>> fields(fields_.begin(), fields_.end());
  std::sort(fields.begin(), fields.end(), [](const auto& first, const auto& second) {
    return first.second.offset < second.second.offset;
  });
  std::uint64_t free = end_of_head;
  for (const auto& [name, field] : fields) {
    if (field.offset < free) {
      file_.fail("expected the values of field '" + name +
                 "' in a place of their own, found them " + "from byte " +
                 with_commas(field.offset) + " on, where there are others.");
    }
    free = field.end();
  }
}

const TensorFile::Field& TensorFile::field(const std::string& name, std::uint8_t type) const {
  const auto found = fields_.find(name);
  if (found == fields_.end()) {
    file_.fail("expected an RGL measurement, found no field '" + name + "'.");
  }
  const Field& field = found->second;
  if (field.type != type) {
    file_.fail("expected values of " + std::string(types[type].name) + " in field '" + name +
               "', found " + types[field.type].name + ".");
  }
  return field;
}

const TensorFile::Shape& TensorFile::shape_of_floats(const std::string& name,
                                                     std::size_t dimensions) const {
  const Field& found = field(name, float32_type);
  if (found.shape.size() != dimensions || found.count == 0) {
    file_.fail("expected values in " + std::to_string(dimensions) +
               (dimensions == 1 ? " dimension" : " dimensions") + " in field '" + name +
               "', found " + written(found.shape) + ".");
  }
  return found.shape;
}

void TensorFile::expect_floats(const std::string& name, const Shape& shape) const {
  const Shape& found = field(name, float32_type).shape;
  if (found == shape) return;
  file_.fail("expected " + written(shape) + " values in field '" + name + "', found " +
             written(found) + ".");
}

std::vector<float> TensorFile::floats(const std::string& name, std::size_t first,
                                      std::size_t count) const {
  std::vector<float> values(count);
  file_.read(field(name, float32_type).offset + sizeof(float) * first, values.data(),
             sizeof(float) * count);
  if (!std::all_of(values.begin(), values.end(), [](float v) { return std::isfinite(v); })) {
    file_.fail("expected finite numbers in field '" + name + "', found one that is not.");
  }
  return values;
}

std::vector<float> TensorFile::floats(const std::string& name) const {
  return floats(name, 0, field(name, float32_type).count);
}

std::uint8_t TensorFile::first_byte(const std::string& name) const {
  const Field& found = field(name, uint8_type);
  if (found.count == 0) file_.fail("expected a value in field '" + name + "', found none.");
  std::uint8_t value = 0;
  file_.read(found.offset, &value, sizeof(value));
  return value;
}

}  // namespace lobefit
