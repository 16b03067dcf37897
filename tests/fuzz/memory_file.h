// A file that exists in memory alone, for readers that take a path.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <span>
#include <string>

namespace lobefit {

class MemoryFile {
 public:
  // `bytes` and then zeros up to `size`, which take no memory before they are read.
  MemoryFile(std::span<const std::uint8_t> bytes, std::size_t size)
      : descriptor_(memfd_create("lobefit", 0)) {
    const bool written =
        descriptor_ >= 0 &&
        write(descriptor_, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size()) &&
        ftruncate(descriptor_, static_cast<off_t>(size)) == 0;
    if (!written) std::abort();
  }
  explicit MemoryFile(std::span<const std::uint8_t> bytes) : MemoryFile(bytes, bytes.size()) {}
  ~MemoryFile() { close(descriptor_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  std::filesystem::path path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }

 private:
  int descriptor_;
};

}  // namespace lobefit
