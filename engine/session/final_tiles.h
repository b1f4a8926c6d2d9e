// The tiles of a render that ended, read from its film ahead of whoever takes them.
#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "engine/film/film.h"
#include "engine/session/worker_pool.h"

namespace lambent {

/// Reading a film of many passes takes far longer than a cancelled render may be waited for. So once someone takes the
/// first tile workers read the others, some MiB ahead, and who takes them reads one only where none is there yet. Any
/// thread may take.
class FinalTiles final : public WorkSource {
 public:
  /// @param tiles which, in the order of reading
  /// @param ready called by a worker after each tile that it has read
  FinalTiles(WorkerPool& pool, std::shared_ptr<const Film> film, std::vector<int> tiles, std::function<void()> ready);
  ~FinalTiles() override;  ///< waits for workers that are reading: a tile's time. Not to be called by a worker
  FinalTiles(const FinalTiles&) = delete;
  FinalTiles& operator=(const FinalTiles&) = delete;

  /// One that was read ahead, else the next, read here; none if the others are taken or being read by workers.
  std::optional<FilmTile> take();
  /// Whether take() will give more, now or once workers have read it.
  bool left() const;

  bool work(int worker) override;

 private:
  FilmTile read(std::unique_lock<std::mutex>& lock);  ///< the next one, with the lock let go meanwhile

  WorkerPool& pool_;
  const std::shared_ptr<const Film> film_;
  const std::vector<int> tiles_;
  const std::function<void()> ready_;

  mutable std::mutex mutex_;
  bool wanted_ = false;        ///< someone has taken one
  size_t next_ = 0;            ///< of tiles_: the first that nobody has begun to read
  int reading_ = 0;            ///< workers
  std::deque<FilmTile> read_;  ///< ahead
  size_t read_bytes_ = 0;
};

}  // namespace lambent
