#include "measurement/input_file.h"

#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

#include "measurement/input_error.h"

namespace lobefit {

std::string with_commas(std::uintmax_t number) {
  std::string digits = std::to_string(number);
  for (int at = static_cast<int>(digits.size()) - 3; at > 0; at -= 3) {
    digits.insert(static_cast<std::size_t>(at), 1, ',');
  }
  return digits;
}

InputFile::InputFile(std::filesystem::path path) : path_(std::move(path)) {
  std::error_code error;
  const auto status = std::filesystem::status(path_, error);
  if (status.type() == std::filesystem::file_type::not_found) {
    fail("expected a measured reflectance file, found no such file.");
  }
  if (std::filesystem::is_directory(status)) {
    fail("expected a measured reflectance file, found a folder.");
  }
  if (!error && !std::filesystem::is_regular_file(status)) {
    fail("expected a measured reflectance file, found something that is not a file.");
  }
  file_.reset(std::fopen(path_.c_str(), "rb"));
  if (!file_) fail("expected a readable file, found: " + std::string(std::strerror(errno)) + ".");
  // Pieces are read whole: a buffer between would only copy them.
  std::setvbuf(file_.get(), nullptr, _IONBF, 0);
  size_ = std::filesystem::file_size(path_, error);
  if (error) fail("expected a readable file, found: " + error.message() + ".");
}

void InputFile::read(std::uintmax_t offset, void* to, std::size_t bytes) const {
  const std::lock_guard lock(turn_);
  if (std::fseek(file_.get(), static_cast<long>(offset), SEEK_SET) != 0 ||
      std::fread(to, 1, bytes, file_.get()) != bytes) {
    fail("expected " + with_commas(size_) +
         " bytes, found its end earlier; did the file change while it was read?");
  }
}

void InputFile::fail(const std::string& why) const {
  throw InputError(path_.string() + ": " + why);
}

}  // namespace lobefit
