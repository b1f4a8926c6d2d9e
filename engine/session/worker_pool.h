// The engine's worker threads. Running renders register a source of work; workers serve the sources in turn, so that
// several sessions share the machine fairly.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

namespace lambent {

/// Hands out short pieces of work (a tile for a few samples: milliseconds to tenths of a second).
class WorkSource {
 public:
  virtual ~WorkSource() = default;
  /// Does one piece on the calling worker. Returns false at once if there is none to start now; the source then calls
  /// WorkerPool::wake() when that changes. Called by several workers at the same time.
  virtual bool work(int worker) = 0;
  /// How many workers may serve it at the same time; 0: all.
  virtual int worker_limit() const { return 0; }
};

class WorkerPool {
 public:
  /// Starts `threads` workers (0: one for each core that this process may use).
  explicit WorkerPool(int threads);
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  int thread_count() const { return static_cast<int>(threads_.size()); }

  /// The source must stay alive until remove() returns.
  void add(WorkSource* source);
  /// Returns once no worker is inside the source.
  void remove(WorkSource* source);
  /// Tells idle workers that some source has work again.
  void wake();

 private:
  struct Entry {
    WorkSource* source;
    int busy = 0;  ///< workers inside
    bool removed = false;
  };
  void run(int worker);

  std::mutex mutex_;
  std::condition_variable work_available_, entry_idle_;
  std::vector<Entry*> entries_;
  uint64_t wake_count_ = 0;
  size_t next_ = 0;
  bool stopping_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace lambent
