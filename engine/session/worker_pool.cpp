#include "engine/session/worker_pool.h"

#include <sched.h>

#include <algorithm>

#include "engine/geometry/geometry.h"

namespace lambent {

namespace {
int usable_cores() {
  cpu_set_t set;
  if (sched_getaffinity(0, sizeof(set), &set) == 0) return std::max(1, CPU_COUNT(&set));
  return std::max(1u, std::thread::hardware_concurrency());
}
}  // namespace

WorkerPool::WorkerPool(int threads) {
  const int count = threads > 0 ? std::min(threads, 1024) : usable_cores();
  threads_.reserve(count);
  for (int worker = 0; worker < count; ++worker) threads_.emplace_back([this, worker] { run(worker); });
}

WorkerPool::~WorkerPool() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  work_available_.notify_all();
  for (std::thread& thread : threads_) thread.join();
  for (Entry* entry : entries_) delete entry;
}

void WorkerPool::add(WorkSource* source) {
  {
    const std::lock_guard lock(mutex_);
    entries_.push_back(new Entry{source});
    ++wake_count_;
  }
  work_available_.notify_all();
}

void WorkerPool::remove(WorkSource* source) {
  std::unique_lock lock(mutex_);
  const auto found = std::find_if(entries_.begin(), entries_.end(), [&](Entry* e) { return e->source == source; });
  if (found == entries_.end()) return;
  Entry* entry = *found;
  entry->removed = true;
  entries_.erase(found);
  entry_idle_.wait(lock, [&] { return entry->busy == 0; });
  delete entry;
}

void WorkerPool::wake() {
  {
    const std::lock_guard lock(mutex_);
    ++wake_count_;
  }
  work_available_.notify_all();
}

void WorkerPool::run(int worker) {
  const DenormalsFlushed denormals;
  std::unique_lock lock(mutex_);
  size_t fruitless = 0;  // sources asked in a row that had nothing
  uint64_t seen_wake = wake_count_;
  while (!stopping_) {
    if (fruitless >= entries_.size()) {
      work_available_.wait(lock, [&] { return stopping_ || wake_count_ != seen_wake; });
      seen_wake = wake_count_;
      fruitless = 0;
      continue;
    }
    Entry* entry = entries_[next_++ % entries_.size()];
    const int limit = entry->source->worker_limit();
    if (limit > 0 && entry->busy >= limit) {
      ++fruitless;
      continue;
    }
    ++entry->busy;
    lock.unlock();
    const bool worked = entry->source->work(worker);
    lock.lock();
    --entry->busy;
    if (entry->removed && entry->busy == 0) entry_idle_.notify_all();
    if (worked && limit > 0) {  // a worker that this source's limit turned away may come back
      ++wake_count_;
      work_available_.notify_one();
    }
    fruitless = worked ? 0 : fruitless + 1;
  }
}

}  // namespace lambent
