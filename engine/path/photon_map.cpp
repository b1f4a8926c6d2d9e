#include "engine/path/photon_map.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <tuple>

#include "engine/base/hash.h"
#include "engine/base/parallel.h"

namespace lambent {

namespace {

/// Photons that a thread sorts or merges before it looks whether it is still wanted: about a hundredth of a second.
constexpr uint32_t k_sorted_at_once = 1u << 16;

bool comes_before(const Photon& l, const Photon& r) {
  const auto key = [](const Photon& p) {
    return std::tuple(p.p_world.x, p.p_world.y, p.p_world.z, p.wi, p.flux.bits, p.normal);
  };
  return key(l) < key(r);
}

/// Sorts a bucket. Where the photons of a whole picture lie in one, all threads do, and stop when it is cancelled.
void sort_bucket(std::span<Photon> photons, const CancelFlag& cancel) {
  const size_t count = photons.size();
  if (count <= k_sorted_at_once) {
    std::sort(photons.begin(), photons.end(), comes_before);
    return;
  }
  const size_t parts = std::bit_ceil((count + k_sorted_at_once - 1) / k_sorted_at_once);
  const auto part = [&](size_t i) { return photons.begin() + static_cast<std::ptrdiff_t>(i * count / parts); };
  tbb::parallel_for(size_t{0}, parts, [&](size_t i) {
    if (!cancel.cancelled()) std::sort(part(i), part(i + 1), comes_before);
  });
  for (size_t width = 1; width < parts; width *= 2)
    tbb::parallel_for(size_t{0}, parts / (2 * width), [&](size_t pair) {
      const size_t i = 2 * width * pair;
      if (!cancel.cancelled()) std::inplace_merge(part(i), part(i + width), part(i + 2 * width), comes_before);
    });
}

}  // namespace

uint32_t PhotonMap::bucket_of(const Cell& cell) const {
  return hash_combine(hash_combine(hash_u32(static_cast<uint32_t>(cell.x)), static_cast<uint32_t>(cell.y)),
                      static_cast<uint32_t>(cell.z)) &
         bucket_mask_;
}

size_t PhotonMap::bytes() const {
  return photons_.capacity() * sizeof(Photon) + records_.capacity() * sizeof(PhotonRecord) +
         events_.capacity() * sizeof(uint64_t) + starts_.capacity() * sizeof(uint32_t);
}

void PhotonMap::build(std::span<PhotonBatch* const> batches, float cell_m, const Bounds3& bounds, uint64_t paths,
                      int threads, const CancelFlag& cancel) {
  paths_ = paths;
  origin_ = bounds.isEmpty() ? Vec3(0.0f) : bounds.min;
  const float extent = bounds.isEmpty() ? 1.0f : max_component(bounds.max - bounds.min);
  const float cell = std::max({cell_m, extent * 0x1p-19f, 1e-30f});
  per_cell_ = 1.0f / cell;

  // Where each batch's photons and records go.
  std::vector<size_t> first_photon, first_record;
  size_t photons = 0, records = 0;
  for (const PhotonBatch* batch : batches) {
    first_photon.push_back(photons);
    first_record.push_back(records);
    photons += batch->photons.size();
    records += batch->records.size();
  }
  const uint32_t buckets = std::bit_ceil(static_cast<uint32_t>(std::clamp<size_t>(photons, 16, size_t(1) << 30)));
  bucket_mask_ = buckets - 1;
  photons_.resize(photons);
  if (!cancel.cancelled()) records_.resize(records);
  const bool keep_events = !batches.empty() && batches[0]->keep_events;
  events_.resize(keep_events ? records : 0);
  starts_.assign(size_t(buckets) + 1, 0);

  const auto count_of = [&](uint32_t bucket) { return std::atomic_ref<uint32_t>(starts_[bucket + 1]); };
  const auto work = [&] {
    tbb::parallel_for(size_t{0}, batches.size(), [&](size_t b) {
      if (cancel.cancelled()) return;
      std::copy(batches[b]->records.begin(), batches[b]->records.end(), records_.begin() + first_record[b]);
      if (keep_events)
        std::copy(batches[b]->events.begin(), batches[b]->events.end(), events_.begin() + first_record[b]);
      for (const Photon& photon : batches[b]->photons)
        count_of(bucket_of(cell_of(photon.p_world))).fetch_add(1, std::memory_order_relaxed);
    });
    if (cancel.cancelled()) return;
    // starts_[b + 1] holds the count of bucket b: turn it into where b begins, as a cursor that ends at b + 1's begin.
    uint32_t running = 0;
    for (uint32_t b = 0; b < buckets; ++b) running += std::exchange(starts_[b + 1], running);
    tbb::parallel_for(size_t{0}, batches.size(), [&](size_t b) {
      if (cancel.cancelled()) return;
      for (Photon photon : batches[b]->photons) {
        photon.record += static_cast<uint32_t>(first_record[b]);
        photons_[count_of(bucket_of(cell_of(photon.p_world))).fetch_add(1, std::memory_order_relaxed)] = photon;
      }
      batches[b]->clear();
    });
    if (cancel.cancelled()) return;
    constexpr uint32_t k_grain = 4096;
    tbb::parallel_for(uint32_t{0}, (buckets + k_grain - 1) / k_grain, [&](uint32_t chunk) {
      if (cancel.cancelled()) return;
      for (uint32_t b = chunk * k_grain, end = std::min(buckets, b + k_grain); b < end; ++b)
        if (starts_[b + 1] - starts_[b] > 1)
          sort_bucket(std::span(photons_).subspan(starts_[b], starts_[b + 1] - starts_[b]), cancel);
    });
  };
  with_threads(threads, work);
  if (cancel.cancelled()) photons_.clear();
}

bool PhotonMap::came_straight(const Photon& photon) const {
  const PhotonRecord* record = &records_[photon.record];
  for (int d = record->depth - 1; d >= 1; --d) {
    do --record;
    while (record->depth != d);
    if (record->flags & k_record_connectible) return false;
  }
  return true;
}

}  // namespace lambent
