// Affine transforms with column vectors: `world_from_object.point(p_object)`.
#pragma once

#include "engine/base/vec.h"

namespace lambent {

/// 3x4 affine map, row-major, applied to column vectors. 48 bytes. Invariant: none (may be singular; see inverse()).
struct Transform {
  float m[3][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};

  /// From 12 floats, 3 rows of 4 (the wire's layout).
  static Transform from_rows(const float* rows);
  static Transform translation(const Vec3& offset);
  static Transform scale(const Vec3& factors);

  Vec3 point(const Vec3& p) const {
    return {m[0][0] * p.x + m[0][1] * p.y + m[0][2] * p.z + m[0][3],
            m[1][0] * p.x + m[1][1] * p.y + m[1][2] * p.z + m[1][3],
            m[2][0] * p.x + m[2][1] * p.y + m[2][2] * p.z + m[2][3]};
  }
  Vec3 vector(const Vec3& v) const {
    return {m[0][0] * v.x + m[0][1] * v.y + m[0][2] * v.z, m[1][0] * v.x + m[1][1] * v.y + m[1][2] * v.z,
            m[2][0] * v.x + m[2][1] * v.y + m[2][2] * v.z};
  }
  /// Multiplies by the transposed linear part: with T = object_from_world, T.transposed_vector(n_object) is the
  /// (unnormalised) normal in world space.
  Vec3 transposed_vector(const Vec3& v) const {
    return {m[0][0] * v.x + m[1][0] * v.y + m[2][0] * v.z, m[0][1] * v.x + m[1][1] * v.y + m[2][1] * v.z,
            m[0][2] * v.x + m[1][2] * v.y + m[2][2] * v.z};
  }
  Vec3 column(int i) const { return {m[0][i], m[1][i], m[2][i]}; }
  Vec3 origin() const { return column(3); }

  /// Determinant of the linear part (double precision: scales to 1e6 and 1e-6 cubed do not overflow).
  double determinant() const;
  /// True if the linear part mirrors (negative determinant).
  bool mirrors() const { return determinant() < 0.0; }
  /// All entries finite and the linear part invertible in float.
  bool is_invertible() const;
  bool is_finite() const;
  /// The inverse, computed in double. Requires is_invertible(); otherwise returns the identity.
  Transform inverse() const;
  /// Bounds of the transformed box; empty stays empty.
  Bounds3 bounds(const Bounds3& box) const;

  friend bool operator==(const Transform&, const Transform&) = default;
};

/// (a * b).point(p) == a.point(b.point(p)) up to rounding; multiplied in double.
Transform operator*(const Transform& a, const Transform& b);

}  // namespace lambent
