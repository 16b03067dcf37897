#include "measurement/large_pages.h"

#ifdef __linux__
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#endif

namespace lobefit {

#ifdef MADV_HUGEPAGE
void ask_for_large_pages(void* memory, std::size_t bytes) {
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  const std::size_t before = (page - reinterpret_cast<std::uintptr_t>(memory) % page) % page;
  if (bytes < before + page) return;
  // A wish: a system that refuses it is as good as before.
  madvise(static_cast<char*>(memory) + before, (bytes - before) / page * page, MADV_HUGEPAGE);
}
#else
void ask_for_large_pages(void*, std::size_t) {}
#endif

}  // namespace lobefit
