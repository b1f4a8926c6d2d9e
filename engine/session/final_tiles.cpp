#include "engine/session/final_tiles.h"

#include <utility>

namespace lambent {

namespace {

/// What is read ahead: enough for the time that a client takes to ask again, and not much memory.
constexpr size_t k_ahead_bytes = size_t(32) << 20;

size_t bytes_of(const FilmTile& tile) { return tile.pixels.size() * sizeof(float); }

}  // namespace

FinalTiles::FinalTiles(WorkerPool& pool, std::shared_ptr<const Film> film, std::vector<int> tiles,
                       std::function<void()> ready)
    : pool_(pool), film_(std::move(film)), tiles_(std::move(tiles)), ready_(std::move(ready)) {
  pool_.add(this);
}

FinalTiles::~FinalTiles() { pool_.remove(this); }

FilmTile FinalTiles::read(std::unique_lock<std::mutex>& lock) {
  const int index = tiles_[next_++];
  lock.unlock();
  FilmTile tile = film_->tile(index);
  lock.lock();
  return tile;
}

bool FinalTiles::work(int) {
  {
    std::unique_lock lock(mutex_);
    if (!wanted_ || next_ == tiles_.size() || read_bytes_ >= k_ahead_bytes) return false;
    ++reading_;
    FilmTile tile = read(lock);
    --reading_;
    read_bytes_ += bytes_of(tile);
    read_.push_back(std::move(tile));
  }
  ready_();
  return true;
}

std::optional<FilmTile> FinalTiles::take() {
  std::unique_lock lock(mutex_);
  if (!std::exchange(wanted_, true)) pool_.wake();
  if (read_.empty()) {
    if (next_ == tiles_.size()) return std::nullopt;
    return read(lock);
  }
  FilmTile tile = std::move(read_.front());
  read_.pop_front();
  const bool was_full = read_bytes_ >= k_ahead_bytes;
  read_bytes_ -= bytes_of(tile);
  const bool room_again = was_full && read_bytes_ < k_ahead_bytes && next_ < tiles_.size();
  lock.unlock();
  if (room_again) pool_.wake();
  return tile;
}

bool FinalTiles::left() const {
  const std::lock_guard lock(mutex_);
  return next_ < tiles_.size() || reading_ > 0 || !read_.empty();
}

}  // namespace lambent
