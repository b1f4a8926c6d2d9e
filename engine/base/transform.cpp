#include "engine/base/transform.h"

namespace lambent {

Transform Transform::from_rows(const float* rows) {
  Transform t;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 4; ++j) t.m[i][j] = rows[4 * i + j];
  return t;
}

Transform Transform::translation(const Vec3& offset) {
  Transform t;
  for (int i = 0; i < 3; ++i) t.m[i][3] = offset[i];
  return t;
}

Transform Transform::scale(const Vec3& factors) {
  Transform t;
  for (int i = 0; i < 3; ++i) t.m[i][i] = factors[i];
  return t;
}

namespace {
double cofactor(const Transform& t, int i, int j) {
  const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
  return double(t.m[i1][j1]) * t.m[i2][j2] - double(t.m[i1][j2]) * t.m[i2][j1];
}
}  // namespace

double Transform::determinant() const {
  return m[0][0] * cofactor(*this, 0, 0) + m[0][1] * cofactor(*this, 0, 1) + m[0][2] * cofactor(*this, 0, 2);
}

bool Transform::is_finite() const {
  for (const auto& row : m)
    for (const float x : row)
      if (!std::isfinite(x)) return false;
  return true;
}

bool Transform::is_invertible() const {
  if (!is_finite()) return false;
  // Singular relative to the product of the column lengths: flat to float precision whatever the scale.
  double lengths = 1.0;
  for (int j = 0; j < 3; ++j)
    lengths *= std::sqrt(double(m[0][j]) * m[0][j] + double(m[1][j]) * m[1][j] + double(m[2][j]) * m[2][j]);
  return lengths > 0.0 && std::fabs(determinant()) > 1e-12 * lengths;
}

Transform Transform::inverse() const {
  if (!is_invertible()) return {};
  const double inverse_determinant = 1.0 / determinant();
  double linear[3][3];
  Transform result;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      linear[i][j] = cofactor(*this, j, i) * inverse_determinant;
      result.m[i][j] = static_cast<float>(linear[i][j]);
    }
  for (int i = 0; i < 3; ++i)
    result.m[i][3] = static_cast<float>(-(linear[i][0] * m[0][3] + linear[i][1] * m[1][3] + linear[i][2] * m[2][3]));
  return result;
}

Bounds3 Transform::bounds(const Bounds3& box) const {
  Bounds3 result;
  if (box.isEmpty()) return result;
  for (int corner = 0; corner < 8; ++corner)
    result.extendBy(point(
        {corner & 1 ? box.max.x : box.min.x, corner & 2 ? box.max.y : box.min.y, corner & 4 ? box.max.z : box.min.z}));
  return result;
}

Transform operator*(const Transform& a, const Transform& b) {
  Transform result;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 4; ++j) {
      double sum = j == 3 ? double(a.m[i][3]) : 0.0;
      for (int k = 0; k < 3; ++k) sum += double(a.m[i][k]) * b.m[k][j];
      result.m[i][j] = static_cast<float>(sum);
    }
  return result;
}

}  // namespace lambent
