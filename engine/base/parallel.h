// Work with a number of threads that somebody chose.
#pragma once

#include <tbb/task_arena.h>

namespace lambent {

/// Runs `work`, whose parallel loops then have so many threads; 0: all there are. Returns what it returns.
template <typename Work>
auto with_threads(int threads, Work&& work) {
  return threads > 0 ? tbb::task_arena(threads).execute(work) : work();
}

}  // namespace lambent
