// The film's memory. Internal to film/.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <vector>

#include "engine/film/film.h"
#include "engine/film/splat_buffer.h"
#include "engine/film/zeroed_vector.h"

namespace lambent {

struct Film::Storage {
  struct Tile {
    std::mutex mutex;                ///< for the pixels of the tile
    std::atomic<uint64_t> dirty{0};  ///< when it became dirty, counted by `clock`; 0: clean
  };

  // By pixel of the region, row by row from the bottom.
  ZeroedVector<double> doubles;         ///< [pixel][FilmLayout::doubles]
  ZeroedVector<float> floats;           ///< [pixel][FilmLayout::floats]
  ZeroedVector<uint32_t> counts;        ///< samples added
  ZeroedVector<double> second_moments;  ///< sums of (R+G+B)²; empty if not asked for
  ZeroedVector<uint8_t> stopped;        ///< 1: converged, gets no more samples; empty if not asked for

  ZeroedVector<float> things;  ///< [pixel][FilmLayout::id_slots][FilmLayout::id_floats()]; of weight 0: free

  std::unique_ptr<SplatBuffer> splats;  ///< null: the film takes none

  std::vector<Tile> tiles;
  std::atomic<uint64_t> clock{0};

  std::mutex rejected_mutex;
  uint64_t rejected_count = 0;
  std::vector<RejectedSample> rejected;  ///< sorted by sample, then row, then column; the first k_recorded

  void mark_dirty(Tile& tile) {
    uint64_t clean = 0;
    tile.dirty.compare_exchange_strong(clean, clock.fetch_add(1, std::memory_order_relaxed) + 1,
                                       std::memory_order_release);
  }
};

}  // namespace lambent
