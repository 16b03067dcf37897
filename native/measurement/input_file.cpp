#include "measurement/input_file.h"

#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

#include "measurement/input_error.h"

namespace lobefit {
namespace {

// As std::fseek, which on Windows knows no place beyond 2 GB.
int seek(std::FILE* file, std::uintmax_t offset) {
#if defined(_WIN32)
  return _fseeki64(file, static_cast<std::int64_t>(offset), SEEK_SET);
#else
  return std::fseek(file, static_cast<long>(offset), SEEK_SET);
#endif
}

}  // namespace

File open_file(const std::filesystem::path& path, const std::string& mode) {
#if defined(_WIN32)
  return File(_wfopen(path.c_str(), std::filesystem::path(mode).c_str()));
#else
  return File(std::fopen(path.c_str(), mode.c_str()));
#endif
}

std::string shown(const std::filesystem::path& path) {
  const auto letters = path.u8string();
  return {letters.begin(), letters.end()};
}

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
  file_ = open_file(path_, "rb");
  if (!file_) fail("expected a readable file, found: " + std::string(std::strerror(errno)) + ".");
  // Pieces are read whole: a buffer between would only copy them.
  std::setvbuf(file_.get(), nullptr, _IONBF, 0);
  size_ = std::filesystem::file_size(path_, error);
  if (error) fail("expected a readable file, found: " + error.message() + ".");
}

void InputFile::read(std::uintmax_t offset, void* to, std::size_t bytes) const {
  const std::lock_guard lock(turn_);
  if (seek(file_.get(), offset) != 0 || std::fread(to, 1, bytes, file_.get()) != bytes) {
    fail("expected " + with_commas(size_) +
         " bytes, found its end earlier; did the file change while it was read?");
  }
}

void InputFile::fail(const std::string& why) const { throw InputError(shown(path_) + ": " + why); }

}  // namespace lobefit
