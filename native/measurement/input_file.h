// Files that are read at places, with sentences for what can be wrong with them.
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>

namespace lobefit {

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

// As std::fopen, with a path of whatever letters the system has.
File open_file(const std::filesystem::path& path, const std::string& mode);

// A path as sentences show it: in UTF-8, which Python takes sentences for, on every system.
std::string shown(const std::filesystem::path& path);

// "34992012" -> "34,992,012", as a person reads it.
std::string with_commas(std::uintmax_t number);

// A regular file that is open for reading.
class InputFile {
 public:
  // Throws InputError for what is not there, is no regular file or may not be read.
  explicit InputFile(std::filesystem::path path);

  std::uintmax_t size() const { return size_; }

  // Fills `to` from `offset` on; may be called from several threads, which take turns. Throws
  // InputError when the file ends before.
  void read(std::uintmax_t offset, void* to, std::size_t bytes) const;

  // Throws an InputError that names the file. `why` ends the sentence.
  [[noreturn]] void fail(const std::string& why) const;

 private:
  std::filesystem::path path_;
  File file_;
  std::uintmax_t size_ = 0;
  mutable std::mutex turn_;
};

}  // namespace lobefit
