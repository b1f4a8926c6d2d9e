// Orthonormal frames around a unit vector. Local z is that vector.
#pragma once

#include "engine/base/vec.h"

namespace lambent {

/// Right-handed orthonormal basis; `n` is local z.
struct Frame {
  Vec3 s, t, n;

  /// Branch-free basis around unit vector n (Duff et al. 2017, "Building an Orthonormal Basis, Revisited").
  static Frame from_normal(const Vec3& n) {
    const float sign = std::copysign(1.0f, n.z);
    const float a = -1.0f / (sign + n.z);
    const float b = n.x * n.y * a;
    return {{1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}, n};
  }

  /// Basis around unit normal n whose s is the part of `tangent` orthogonal to n; from_normal(n) if there is none.
  static Frame from_normal_and_tangent(const Vec3& n, const Vec3& tangent) {
    const Vec3 s = normalize(tangent - n * dot(tangent, n));
    if (length_squared(s) == 0.0f) return from_normal(n);
    return {s, cross(n, s), n};
  }

  Vec3 to_local(const Vec3& v_world) const { return {dot(v_world, s), dot(v_world, t), dot(v_world, n)}; }
  Vec3 to_world(const Vec3& v_local) const { return s * v_local.x + t * v_local.y + n * v_local.z; }
};

}  // namespace lambent
