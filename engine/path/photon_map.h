// The photons of one pass in a hashed grid, for queries of any radius.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/base/cancel.h"
#include "engine/path/photon.h"

namespace lambent {

/// Immutable once built; threads share it. Its content does not depend on the order of the batches or of threads:
/// photons of a cell are sorted by what they are.
class PhotonMap {
 public:
  /// Takes the batches' photons and records over (the batches are emptied and keep their memory).
  /// @param cell_m edge of a cell: about twice the usual radius. At most 2^20 cells a side are told apart
  /// @param paths light walks that the photons stand for
  /// @param threads to build with; 0: all. Linear in the photons
  /// @param cancel once it is set the rest is left undone and the map is empty
  void build(std::span<PhotonBatch* const> batches, float cell_m, const Bounds3& bounds, uint64_t paths, int threads,
             const CancelFlag& cancel = CancelFlag{});

  bool empty() const { return photons_.empty(); }
  size_t size() const { return photons_.size(); }
  uint64_t paths() const { return paths_; }
  size_t bytes() const;
  const PhotonRecord& record(uint32_t index) const { return records_[index]; }
  /// Whether nothing but delta events lie between the light and the photon.
  bool came_straight(const Photon& photon) const;
  /// LightVertex::events of a record; 0 unless the batches kept them.
  uint64_t events(uint32_t record) const { return events_.empty() ? 0 : events_[record]; }

  /// Calls visit(const Photon&, float scale) for photons nearer to p than `radius`. Where more than `most` candidates
  /// lie in the cells around, every k-th from a place given by `u` in [0, 1) is looked at, scale being k: the expected
  /// sum stays the same.
  template <typename Visit>
  void query(const Vec3& p, float radius, size_t most, float u, Visit&& visit) const {
    if (photons_.empty() || !(radius > 0.0f)) return;
    const Cell low = cell_of(p - Vec3(radius)), high = cell_of(p + Vec3(radius));
    const float radius_squared = radius * radius;
    // Cells with candidates: the first of them are kept, and if there are more, all are visited again.
    struct Run {
      Cell cell;
      uint32_t begin, end;
    };
    constexpr size_t k_kept = 27;
    std::array<Run, k_kept> kept;
    size_t candidates = 0, runs = 0;
    const auto for_each_cell = [&](auto&& act) {
      for (int32_t z = low.z; z <= high.z; ++z)
        for (int32_t y = low.y; y <= high.y; ++y)
          for (int32_t x = low.x; x <= high.x; ++x) {
            const Cell cell{x, y, z};
            const uint32_t bucket = bucket_of(cell);
            const uint32_t begin = starts_[bucket], end = starts_[bucket + 1];
            if (begin < end) act(Run{cell, begin, end});
          }
    };
    for_each_cell([&](const Run& run) {
      candidates += run.end - run.begin;
      if (runs < k_kept) kept[runs] = run;
      ++runs;
    });
    if (candidates == 0) return;
    const size_t step = candidates > most ? (candidates + most - 1) / most : 1;
    size_t skip = step > 1 ? std::min(static_cast<size_t>(u * static_cast<float>(step)), step - 1) : 0;
    // Each is visited once the next is found, so that its record, which may lie anywhere, has come by then.
    const Photon* found = nullptr;
    const auto visit_run = [&](const Run& run) {
      size_t i = run.begin + skip;
      for (; i < run.end; i += step) {
        const Photon& photon = photons_[i];
        // Several cells may share a bucket: a photon counts for its own.
        if (!(length_squared(photon.p_world - p) < radius_squared) || !(cell_of(photon.p_world) == run.cell)) continue;
        __builtin_prefetch(&records_[photon.record]);
        if (!events_.empty()) __builtin_prefetch(&events_[photon.record]);
        if (found) visit(*found, static_cast<float>(step));
        found = &photon;
      }
      skip = i - run.end;
    };
    if (runs <= k_kept)
      std::for_each_n(kept.begin(), runs, visit_run);
    else
      for_each_cell(visit_run);
    if (found) visit(*found, static_cast<float>(step));
  }

 private:
  struct Cell {
    int32_t x, y, z;
    friend bool operator==(const Cell&, const Cell&) = default;
  };
  Cell cell_of(const Vec3& p) const {
    const auto along = [&](float v, float low) {
      return static_cast<int32_t>(std::clamp(std::floor((v - low) * per_cell_), -2.0f, static_cast<float>(1 << 20)));
    };
    return {along(p.x, origin_.x), along(p.y, origin_.y), along(p.z, origin_.z)};
  }
  uint32_t bucket_of(const Cell& cell) const;

  std::vector<Photon> photons_;   ///< by bucket
  std::vector<uint32_t> starts_;  ///< by bucket, one more
  std::vector<PhotonRecord> records_;
  std::vector<uint64_t> events_;
  Vec3 origin_{0.0f};
  float per_cell_ = 1.0f;
  uint32_t bucket_mask_ = 0;
  uint64_t paths_ = 0;
};

}  // namespace lambent
