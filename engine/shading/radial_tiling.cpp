// Facts as in Cycles 5: distances are to the polygon through the unit circle's tangents, with corners cut by arcs, and
// along an arc the place is measured by a curve that joins the straight part without a kink.
#include "engine/shading/patterns.h"

namespace lambent {
namespace {

// Where the arc of a corner begins and how places along it are measured.
struct Corner {
  float bevel;   ///< angle from the corner to where the straight part begins
  float beyond;  ///< from there to the middle of the side
  float roundness, blend;

  Corner(float half_rad, float bevel_rad, float round)
      : bevel(bevel_rad), beyond(half_rad - bevel_rad), roundness(round), blend((1.0f - round) * bevel_rad) {}

  float arc() const { return roundness * bevel; }
  float width() const { return std::tan(beyond) + blend + arc(); }
  /// Half of the segment's width at a distance from the centre: of the side, or along the direction itself.
  float half_width(float to_side) const { return to_side * std::tan(beyond) + blend * (0.5f * to_side + 0.5f) + arc(); }
  float half_width_at(float distance) const {
    return distance * std::sin(beyond) + blend * (0.5f * distance * std::cos(beyond) + 0.5f) + arc();
  }
  /// Distance from the middle of the side to a place at an angle `past` beyond the start of the arc.
  float along(float distance, float past) const {
    const float across = distance * std::cos(beyond);
    const float curve = past < blend ? across * past + 0.5f * (1.0f - across) * past * past / blend
                                     : blend * (0.5f * across - 0.5f) + past;
    return distance * std::sin(beyond) + curve;
  }
  /// That over the half width there.
  float share(float distance, float to_side, float past) const {
    return lerp(half_width(to_side), half_width_at(distance), past / bevel);
  }
};

float bevel_of(float half_rad, float roundness) {
  if (roundness == 0.0f) return 0.0f;
  return half_rad - std::atan((1.0f - roundness) * std::tan(half_rad));
}

// One place, and what is the same for all segments.
struct Tiling {
  float distance, angle, half, segment, within;
  float roundness;
  bool normalize;

  // Before the sign, and before the shift that makes it start at 0.
  RadialTile tile(float along, float share, float to_side, float width, float middle) const {
    if (normalize) along /= share;
    if (within < middle) along = -along;
    return {along, to_side, segment, width, segment * 2.0f * half + middle};
  }
  RadialTile straight(const Corner& corner, float width) const {
    const float to_side = distance * std::cos(half - within);
    return tile(to_side * std::tan(std::fabs(half - within)), corner.half_width(to_side), to_side, width, half);
  }
  RadialTile rounded(const Corner& corner) const {
    const float from_corner = within - (within > half ? 2.0f * half : 0.0f);
    const float centre = (1.0f - roundness) / std::cos(half), c = std::cos(from_corner) * centre;
    const float to_side = distance / (c + std::sqrt(c * c + roundness * roundness - centre * centre));
    const float past = corner.bevel - std::fabs(from_corner);
    return tile(corner.along(distance, past), corner.share(distance, to_side, past), to_side, corner.width(), half);
  }
  RadialTile regular(const Corner& corner) const {
    const bool corner_part = within < corner.bevel || within >= 2.0f * half - corner.bevel;
    return corner_part ? rounded(corner) : straight(corner, corner.width());
  }

  RadialTile with_last(const Vec2& p, float sides) const;
};

// Where the number of sides is broken: the last segment is narrower, and its corners' arcs reach into both neighbours.
RadialTile Tiling::with_last(const Vec2& p, float sides) const {
  constexpr float k_turn = 2.0f * k_pi;
  const float last_half = k_pi - std::floor(sides) * half, last_start = k_turn - 2.0f * last_half;
  const float ratio = std::cos(half) / std::cos(last_half);
  const Corner corner(half, bevel_of(half, roundness), roundness);
  if (roundness == 0.0f) {
    if (angle < last_start) return straight(corner, corner.width());
    const float to_last = distance * std::cos(last_half - within), tangent = std::tan(last_half);
    return tile(ratio * to_last * std::tan(std::fabs(last_half - within)), ratio * to_last * tangent, ratio * to_last,
                tangent, last_half);
  }
  const Corner inner(last_half, bevel_of(last_half, roundness), roundness);
  const float radius = roundness * std::tan(last_half) / std::tan(0.5f * (half + last_half));
  const float reach = 1.0f / std::cos(inner.beyond);
  const Vec2 centre{std::cos(inner.bevel) * reach - radius * std::cos(last_half),
                    radius * std::sin(last_half) - std::sin(inner.bevel) * reach};
  const float outer_start = std::atan((centre.y + radius * std::sin(half)) / (centre.x + radius * std::cos(half)));
  const Corner outer(half, outer_start, 1.0f - std::tan(half - outer_start) / std::tan(half));

  if (angle >= outer_start && angle < last_start - outer_start) {
    const bool straight_part = (within >= corner.bevel && within < 2.0f * half - corner.bevel) ||
                               angle >= last_start - corner.bevel || angle < corner.bevel;
    if (!straight_part) return rounded(corner);
    const bool beside_last = angle >= last_start - half || angle < half;
    return straight(beside_last ? outer : corner, corner.width());
  }
  const float inner_width = std::tan(inner.beyond) + ratio * (inner.blend * (0.5f / ratio + 0.5f) + inner.arc());
  if (angle >= last_start + inner.bevel && angle < k_turn - inner.bevel) {
    const float to_last = distance * std::cos(last_half - within);
    return tile(ratio * to_last * std::tan(std::fabs(last_half - within)), ratio * inner.half_width(to_last),
                ratio * to_last, inner_width, last_half);
  }
  // Both corners of the last segment are mirror images.
  float from_corner = std::atan2(p.y, p.x);
  if (angle >= last_start - outer_start && angle < k_turn - last_half) from_corner = -(from_corner + 2.0f * last_half);
  const float c = std::sin(from_corner) * centre.y + std::cos(from_corner) * centre.x;
  const float to_last = distance / (c + std::sqrt(c * c + radius * radius - centre.x * centre.x - centre.y * centre.y));
  const float to_side = ratio * to_last;
  if (from_corner < 0.0f) {
    const float past = inner.bevel + from_corner;
    return tile(ratio * inner.along(distance, past), ratio * inner.share(distance, to_last, past), to_side, inner_width,
                last_half);
  }
  const float past = outer_start - from_corner;
  return tile(outer.along(distance, past), outer.share(distance, to_side, past), to_side, corner.width(), half);
}

}  // namespace

RadialTile radial_tiling(const Vec2& p, float given_sides, float given_roundness, bool normalize) {
  if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(given_sides) || !std::isfinite(given_roundness))
    return {};
  const float sides = std::max(given_sides, 2.0f);
  Tiling t;
  t.distance = std::sqrt(p.x * p.x + p.y * p.y);
  t.angle = std::atan2(p.y, p.x) + (p.y < 0.0f ? 2.0f * k_pi : 0.0f);
  t.half = k_pi / sides;
  t.segment = std::floor(t.angle / (2.0f * t.half));
  t.within = t.angle - t.segment * 2.0f * t.half;
  t.roundness = std::clamp(given_roundness, 0.0f, 1.0f);
  t.normalize = normalize;
  RadialTile tile;
  if (sides != std::floor(sides)) {
    tile = t.with_last(p, sides);
  } else if (sides == 2.0f && t.roundness == 0.0f) {  // a strip without end
    const float to_side = t.distance * std::cos(t.half - t.within);
    tile = t.tile(to_side * std::tan(std::fabs(t.half - t.within)), 1.0f, to_side, 0.0f, t.half);
  } else {
    tile = t.regular(Corner(t.half, bevel_of(t.half, t.roundness), t.roundness));
  }
  if (p.x == 0.0f && p.y == 0.0f) tile.along = 0.0f;
  if (normalize)
    tile.along = 0.5f * tile.along + 0.5f;
  else
    tile.outwards -= 1.0f;
  tile.segment = std::floor(sides * (std::atan2(p.y, p.x) / (2.0f * k_pi) + (p.y < 0.0f ? 1.0f : 0.0f)));
  for (float* x : {&tile.along, &tile.outwards, &tile.segment, &tile.width, &tile.rotation_rad})
    if (!std::isfinite(*x)) *x = 0.0f;
  return tile;
}

}  // namespace lambent
