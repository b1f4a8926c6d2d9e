#include "engine/geometry/triangle_mesh.h"

namespace lambent {

namespace {

/// Twice the area times the normal. In double: the products of differences of floats are exact to the last bits, so
/// slivers and tiny triangles have the right direction, and collinear corners give exactly 0.
Vec3d area_vector(const Triangle& triangle) {
  const Vec3d p0(triangle[0]), e1 = Vec3d(triangle[1]) - p0, e2 = Vec3d(triangle[2]) - p0;
  return e1.cross(e2);
}

Vec4 padded(const float* values, int components) {
  if (components == 1) return {values[0], values[0], values[0], 1};
  Vec4 result(0, 0, 0, 1);
  for (int i = 0; i < components; ++i) result[i] = values[i];
  return result;
}

}  // namespace

double TriangleMesh::area(uint32_t primitive) const {
  const Vec3d n = area_vector(triangle(primitive));
  return 0.5 * std::sqrt(n.dot(n));
}

Vec3 TriangleMesh::geometric_normal(uint32_t primitive) const {
  const Vec3d n = area_vector(triangle(primitive));
  const double l = std::sqrt(n.dot(n));
  return l > 0.0 ? Vec3(n / l) : Vec3(0.0f);
}

std::array<size_t, 3> TriangleMesh::elements(AttributeDomain domain, uint32_t primitive) const {
  if (domain == AttributeDomain::face) return {face(primitive), face(primitive), face(primitive)};
  const auto [a, b, c] = domain == AttributeDomain::vertex ? vertices(primitive) : corners(primitive);
  return {a, b, c};
}

std::array<Vec3, 3> TriangleMesh::corner_normals(uint32_t primitive) const {
  std::array<Vec3, 3> normals;
  const std::array<size_t, 3> at = elements(normals_domain_, primitive);
  for (size_t k = 0; k < 3; ++k) {
    const float* n = normals_.values.data() + 3 * at[k];
    normals[k] = {n[0], n[1], n[2]};
  }
  return normals;
}

Vec3 TriangleMesh::shading_normal(uint32_t primitive, const Vec2& barycentric) const {
  if (has_normals()) {
    const auto [a, b, c] = corner_normals(primitive);
    const float u = barycentric.x, v = barycentric.y;
    const Vec3 n = normalize(a * (1.0f - u - v) + b * u + c * v);
    if (length_squared(n) > 0.0f) return n;
  }
  return geometric_normal(primitive);
}

Vec3 TriangleMesh::shading_normal_world(uint32_t primitive, const Vec2& barycentric,
                                        const Transform& object_from_world) const {
  if (!has_normals()) return Vec3(0.0f);
  std::array<Vec3, 3> n = corner_normals(primitive);
  for (Vec3& normal : n) normal = normalize(object_from_world.transposed_vector(normal));
  const float u = barycentric.x, v = barycentric.y;
  return normalize(n[0] * (1.0f - u - v) + n[1] * u + n[2] * v);
}

int TriangleMesh::find_attribute(std::string_view name) const {
  for (size_t i = 0; i < attributes_.size(); ++i)
    if (attributes_[i].name == name) return static_cast<int>(i);
  return -1;
}

int TriangleMesh::find_role(AttributeRole role, std::string_view name, const std::string& active) const {
  if (name.empty()) name = active;
  for (size_t i = 0; i < attributes_.size(); ++i)
    if (attributes_[i].role == role && (name.empty() || attributes_[i].name == name)) return static_cast<int>(i);
  return -1;
}

Vec4 TriangleMesh::attribute(int index, uint32_t primitive, const Vec2& barycentric) const {
  const MeshAttribute& attribute = attributes_[static_cast<size_t>(index)];
  if (attribute.components == 2 && attribute.domain != AttributeDomain::face) {  // UVs, in fewer steps
    const auto [a, b, c] = attribute.domain == AttributeDomain::vertex ? vertices(primitive) : corners(primitive);
    const float* const at[3] = {attribute.values.values.data() + 2 * size_t(a),
                                attribute.values.values.data() + 2 * size_t(b),
                                attribute.values.values.data() + 2 * size_t(c)};
    const auto value = [&](int k) {
      return at[0][k] + (at[1][k] - at[0][k]) * barycentric.x + (at[2][k] - at[0][k]) * barycentric.y;
    };
    return {value(0), value(1), 0, 1};
  }
  return attribute_gradient(index, primitive, barycentric).value;
}

TriangleMesh::AttributeGradient TriangleMesh::attribute_gradient(int index, uint32_t primitive,
                                                                 const Vec2& barycentric) const {
  const MeshAttribute& attribute = attributes_[static_cast<size_t>(index)];
  const int n = attribute.components;
  const float* values = attribute.values.values.data();
  const auto [a, b, c] = elements(attribute.domain, primitive);
  const Vec4 value_a = padded(values + a * size_t(n), n);
  if (attribute.domain == AttributeDomain::face) return {value_a, {0, 0, 0, 0}, {0, 0, 0, 0}};
  const Vec4 du = padded(values + b * size_t(n), n) - value_a, dv = padded(values + c * size_t(n), n) - value_a;
  return {value_a + du * barycentric.x + dv * barycentric.y, du, dv};
}

Vec3 TriangleMesh::generated(const Vec3& p_object) const {
  Vec3 result;
  for (int i = 0; i < 3; ++i) {
    // A flat texture space (size 0) maps to its middle, as in Cycles.
    const float scale = texture_space_size_[i] != 0.0f ? 0.5f / texture_space_size_[i] : 0.0f;
    result[i] = (p_object[i] - texture_space_location_[i]) * scale + 0.5f;
  }
  return result;
}

}  // namespace lambent
