// Photons: light vertices in the compact form that merging needs.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/path/light_walk.h"

namespace lambent {

/// RGB with one exponent of 10 bits and 18 bits a channel, signs included: flux of any scale to within 8e-6 of its
/// largest channel.
struct PackedColor {
  uint64_t bits = 0;
  static PackedColor of(const Color& color);
  Color unpack() const;
};

/// Unit vector in 32 bits (octahedral; Cigolle et al. 2014), off by at most 1e-4.
uint32_t pack_direction(const Vec3& unit);
Vec3 unpack_direction(uint32_t bits);

/// What a query looks at. 32 bytes.
struct Photon {
  Vec3 p_world{0.0f};
  uint32_t wi = 0;      ///< pack_direction: towards the light's side
  PackedColor flux;     ///< W
  uint32_t normal = 0;  ///< pack_direction: geometric normal on wi's side
  uint32_t record = 0;  ///< number of its PhotonRecord
};
static_assert(sizeof(Photon) == 32);

/// What weights and limits need of a vertex. 20 bytes. A walk's records lie one after the other, that of the light
/// (depth 0) first; the vertex before one at depth d is the last record above it with depth d - 1.
struct PhotonRecord {
  float own = 0.0f;                       ///< l (path_pdfs.h); depth 0: next_event
  float other = 0.0f;                     ///< c, final if the walk scattered at the next; depth 0: scatter
  float previous_per_solid_angle = 0.0f;  ///< LightVertex's; depths 0 and 1: conditional
  union {
    struct {
      uint8_t diffuse, glossy, transmission, transparent;  ///< LightVertex::counts
    } counts;
    LightIndex light;  ///< depth 0
  };
  uint16_t depth = 0;
  uint16_t flags = 0;  ///< k_record_* bits

  PhotonRecord() : light(k_no_light) {}
};
static_assert(sizeof(PhotonRecord) == 20);

inline constexpr uint16_t k_record_connectible = 1;  ///< the event there had a density
inline constexpr uint16_t k_record_can_be_hit = 2;   ///< depth 0: camera walks may meet the light
inline constexpr int k_record_place_shift = 3;       ///< above: LightVertex::place, below k_record_places
inline constexpr int k_record_places = 1 << 13;
inline constexpr uint16_t k_record_limited = 4;  ///< the light's max_bounces may matter

/// Photons and records of some walks, in their order.
struct PhotonBatch {
  bool keep_events = false;  ///< for passes that ask for the sequence of events
  std::vector<Photon> photons;
  std::vector<PhotonRecord> records;
  std::vector<uint64_t> events;  ///< LightVertex::events by record; empty unless they are kept

  void clear();
  /// Takes over a walk's vertices; photons are made of those at depth `first` or more that scatter with a density.
  void add(const LightWalk& walk, int first);
};

}  // namespace lambent
