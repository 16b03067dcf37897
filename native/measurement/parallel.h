// Work shared between threads.
#pragma once

#include <functional>

namespace lobefit {

// The number of threads that `asked` stands for: itself, or for 0 what the machine has.
int thread_count(int asked);

// Calls work(0) .. work(count - 1), each once, on up to `threads` threads, the caller's among
// them, or as many as the system gives, and returns when all are done. An exception of any of them
// is thrown on.
void parallel_for(int count, int threads, const std::function<void(int)>& work);

}  // namespace lobefit
