#include "engine/path/photon.h"

#include <algorithm>
#include <cmath>

namespace lambent {

namespace {

constexpr int k_mantissa_bits = 17;  // and a sign
constexpr int k_exponent_bias = 400;
/// Lamps' max_bounces from here on (Blender's default is 1024) are taken as no limit by photons.
constexpr int k_many_bounces = 1024;

float sign_of(float x) { return std::signbit(x) ? -1.0f : 1.0f; }

}  // namespace

PackedColor PackedColor::of(const Color& color) {
  const float largest = max_component(abs(color));
  if (!(largest > 0.0f) || !std::isfinite(largest)) return {};
  int exponent;
  std::frexp(largest, &exponent);
  const double scale = std::ldexp(1.0, k_mantissa_bits - exponent);
  uint64_t bits = static_cast<uint64_t>(exponent + k_exponent_bias) << 54;
  for (int c = 0; c < 3; ++c) {
    const double mantissa = static_cast<double>(color[c]) * scale;
    const int limit = (1 << k_mantissa_bits) - 1;
    const int rounded = std::clamp(static_cast<int>(mantissa + std::copysign(0.5, mantissa)), -limit, limit);
    bits |= static_cast<uint64_t>(rounded & 0x3ffff) << (18 * c);
  }
  return {bits};
}

Color PackedColor::unpack() const {
  if (bits == 0) return Color(0.0f);
  const int exponent = static_cast<int>(bits >> 54) - k_exponent_bias;
  const double scale = std::ldexp(1.0, exponent - k_mantissa_bits);
  Color color;
  for (int c = 0; c < 3; ++c) {
    const int field = static_cast<int>(bits >> (18 * c)) & 0x3ffff;
    const int mantissa = field >= 0x20000 ? field - 0x40000 : field;
    color[c] = static_cast<float>(mantissa * scale);
  }
  return color;
}

uint32_t pack_direction(const Vec3& unit) {
  const float norm = std::fabs(unit.x) + std::fabs(unit.y) + std::fabs(unit.z);
  if (!(norm > 0.0f)) return 0;
  float u = unit.x / norm, v = unit.y / norm;
  if (unit.z < 0.0f) {
    const float folded = (1.0f - std::fabs(v)) * sign_of(u);
    v = (1.0f - std::fabs(u)) * sign_of(v);
    u = folded;
  }
  const auto quantised = [](float x) {
    return static_cast<uint32_t>(std::lround((std::clamp(x, -1.0f, 1.0f) * 0.5f + 0.5f) * 65535.0f));
  };
  return quantised(u) | quantised(v) << 16;
}

Vec3 unpack_direction(uint32_t bits) {
  float u = static_cast<float>(bits & 0xffffu) * (2.0f / 65535.0f) - 1.0f;
  float v = static_cast<float>(bits >> 16) * (2.0f / 65535.0f) - 1.0f;
  const float z = 1.0f - std::fabs(u) - std::fabs(v);
  if (z < 0.0f) {
    const float folded = (1.0f - std::fabs(v)) * sign_of(u);
    v = (1.0f - std::fabs(u)) * sign_of(v);
    u = folded;
  }
  return normalize(Vec3(u, v, z));
}

void PhotonBatch::clear() {
  photons.clear();
  records.clear();
  events.clear();
}

void PhotonBatch::add(const LightWalk& walk, int first) {
  bool any = false;
  for (int i = 0; i < walk.size(); ++i) any |= walk[i].depth >= first;
  if (!any) return;
  PhotonRecord light;
  light.own = walk.pdfs().next_event;
  light.other = walk.pdfs().other[0];
  light.previous_per_solid_angle = walk.pdfs().conditional;
  light.light = walk.light();
  light.flags = walk.can_be_hit() ? k_record_can_be_hit : 0;
  records.push_back(light);
  if (keep_events) events.push_back(0);
  const uint16_t limited = walk.traits().max_bounces < k_many_bounces ? k_record_limited : 0;
  const auto saturated = [](int count) { return static_cast<uint8_t>(std::min(count, 255)); };
  for (int i = 0; i < walk.size(); ++i) {
    const LightVertex& vertex = walk[i];
    const size_t depth = static_cast<size_t>(vertex.depth);
    PhotonRecord record;
    record.own = vertex.own_area;
    record.other = walk.pdfs().other[depth];
    record.previous_per_solid_angle = depth > 1 ? vertex.previous_per_solid_angle : vertex.conditional;
    record.counts = {saturated(vertex.counts.diffuse), saturated(vertex.counts.glossy),
                     saturated(vertex.counts.transmission), saturated(vertex.counts.transparent)};
    record.depth = static_cast<uint16_t>(vertex.depth);
    record.flags = static_cast<uint16_t>((walk.pdfs().connectible[depth] ? k_record_connectible : 0) | limited |
                                         vertex.place << k_record_place_shift);
    // Surfaces where light walks end still merge: the camera walk evaluates there, or leaves there from under them.
    const bool merges = vertex.depth >= first && (vertex.bsdf.has_non_delta() || vertex.bsdf.empty() ||
                                                  vertex.binding->program->traits().subsurface);
    if (merges)
      photons.push_back({vertex.surface.p_world, pack_direction(vertex.wi_world), PackedColor::of(vertex.throughput),
                         pack_direction(vertex.ng_world), static_cast<uint32_t>(records.size())});
    records.push_back(record);
    if (keep_events) events.push_back(vertex.events);
  }
}

}  // namespace lambent
