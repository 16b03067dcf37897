// Memory in large pages.
#pragma once

#include <cstddef>

namespace lobefit {

// Asks the system to hold memory that nobody has touched yet in large pages, where it knows them:
// touching the 60 MB of a fit page by page takes as long as reading the file.
void ask_for_large_pages(void* memory, std::size_t bytes);

}  // namespace lobefit
