// Triangles in object space, as the renderer reads them: validated, immutable, shared by pointer.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/report.h"
#include "engine/base/transform.h"
#include "engine/base/vec.h"

namespace lambent {

/// Read-only elements and whoever keeps their memory alive. The memory must not change while any copy exists.
template <typename T>
struct SharedSpan {
  std::span<const T> values;
  std::shared_ptr<const void> owner;

  SharedSpan() = default;
  SharedSpan(std::span<const T> elements, std::shared_ptr<const void> keeper)
      : values(elements), owner(std::move(keeper)) {}
  /// Takes a vector over.
  explicit SharedSpan(std::vector<T> elements) {
    auto kept = std::make_shared<const std::vector<T>>(std::move(elements));
    values = *kept;
    owner = std::move(kept);
  }
  bool empty() const { return values.empty(); }
  size_t size() const { return values.size(); }
  const T& operator[](size_t i) const { return values[i]; }
};

/// What a value belongs to: a vertex, a corner of a face, or a face.
enum class AttributeDomain : uint8_t { vertex, corner, face };
enum class AttributeRole : uint8_t { generic, uv, color };

/// A named value that varies over a mesh.
struct MeshAttribute {
  std::string name;
  AttributeDomain domain = AttributeDomain::corner;
  AttributeRole role = AttributeRole::generic;
  int components = 1;        ///< 1 to 4
  SharedSpan<float> values;  ///< float[N][components]
};

/// What a TriangleMesh is made from. Object space, metres.
struct MeshInput {
  std::string name;                         ///< the user's, for messages
  SharedSpan<float> positions;              ///< float[V][3]
  SharedSpan<uint32_t> triangles;           ///< uint32[T][3], vertex indices
  SharedSpan<uint32_t> triangle_corners;    ///< uint32[T][3], indices into corner values; empty: 3t+k
  SharedSpan<uint32_t> triangle_faces;      ///< uint32[T], indices into face values; empty: t
  SharedSpan<uint16_t> triangle_materials;  ///< uint16[T], material slots; empty: 0
  SharedSpan<float> normals;                ///< float[N][3]; empty: flat
  AttributeDomain normals_domain = AttributeDomain::corner;
  std::vector<MeshAttribute> attributes;
  std::string active_uv, active_color;                          ///< names; empty: the first of that role
  Vec3 texture_space_location{0.0f}, texture_space_size{1.0f};  ///< generated = (p - location) / (2 size) + 1/2
};

/// Three vertices.
using Triangle = std::array<Vec3, 3>;

/// Point p = (1 - u - v) p0 + u p1 + v p2 for barycentric (u, v). All results are in object space.
/// Invariants: every index is in range, every position used is finite, attribute counts fit. Thread-safe.
class TriangleMesh {
 public:
  /// Validates and takes over the arrays without copying them, except to leave out triangles that cannot be used
  /// (an index out of range, a vertex that is not finite): those are reported by mesh name, and primitive numbers count
  /// the triangles kept. Attributes and normals with a wrong count are reported and left out. Never fails: what is
  /// unusable altogether gives an empty mesh and a report. Cost: one pass over the arrays.
  static std::shared_ptr<const TriangleMesh> create(MeshInput input, Report& report);
  /// The same mesh with its vertices elsewhere: attributes, tangents and what undisplaced() gives stay those of `mesh`,
  /// whose arrays are shared. @param positions float[vertex_count][3], finite where those of the mesh are
  /// @param normals as many as mesh.normals(), in the same domain; empty: flat
  static std::shared_ptr<const TriangleMesh> create_displaced(std::shared_ptr<const TriangleMesh> mesh,
                                                              std::vector<float> positions, std::vector<float> normals,
                                                              Report& report);
  ~TriangleMesh();
  TriangleMesh(const TriangleMesh&) = delete;
  TriangleMesh& operator=(const TriangleMesh&) = delete;

  const std::string& name() const { return name_; }
  uint32_t triangle_count() const { return triangle_count_; }
  uint32_t vertex_count() const { return vertex_count_; }
  bool empty() const { return triangle_count_ == 0; }
  /// Triangles left out by create().
  uint64_t dropped_triangles() const { return dropped_triangles_; }
  /// Of the vertices that triangles use.
  const Bounds3& bounds_object() const { return bounds_; }
  /// Memory of the arrays, shared or own.
  size_t bytes() const { return bytes_; }
  /// Largest material slot of any triangle.
  uint32_t max_material_slot() const { return max_material_slot_; }

  const float* positions() const { return positions_.values.data(); }   ///< float[vertex_count][3]
  const uint32_t* indices() const { return triangles_.values.data(); }  ///< uint32[triangle_count][3]

  std::array<uint32_t, 3> vertices(uint32_t primitive) const {
    const uint32_t* i = indices() + 3 * size_t(primitive);
    return {i[0], i[1], i[2]};
  }
  std::array<uint32_t, 3> corners(uint32_t primitive) const {
    if (triangle_corners_.empty()) return {3 * primitive, 3 * primitive + 1, 3 * primitive + 2};
    const uint32_t* i = triangle_corners_.values.data() + 3 * size_t(primitive);
    return {i[0], i[1], i[2]};
  }
  uint32_t face(uint32_t primitive) const { return triangle_faces_.empty() ? primitive : triangle_faces_[primitive]; }
  uint32_t material_slot(uint32_t primitive) const {
    return triangle_materials_.empty() ? 0u : triangle_materials_[primitive];
  }
  Vec3 vertex(uint32_t index) const {
    const float* p = positions() + 3 * size_t(index);
    return {p[0], p[1], p[2]};
  }
  Triangle triangle(uint32_t primitive) const {
    const auto [a, b, c] = vertices(primitive);
    return {vertex(a), vertex(b), vertex(c)};
  }

  /// Area in object space, m², in double: tiny and huge triangles keep their precision. 0 exactly if degenerate.
  double area(uint32_t primitive) const;
  /// Whether the corners lie on a line: no normal, never emits.
  bool is_degenerate(uint32_t primitive) const { return area(primitive) <= 0.0; }

  /// What it was before its vertices moved; itself if none did.
  const TriangleMesh& undisplaced() const { return undisplaced_ ? *undisplaced_ : *this; }

  std::span<const float> normals() const { return normals_.values; }  ///< float[N][3]; zero: the geometric normal
  AttributeDomain normals_domain() const { return normals_domain_; }  ///< vertex or corner
  bool has_normals() const { return !normals_.empty(); }
  /// Unit; follows the winding p0, p1, p2. The zero vector for a degenerate triangle.
  Vec3 geometric_normal(uint32_t primitive) const;
  /// Unit interpolated normal; the geometric normal where there is none or the interpolated one vanishes.
  Vec3 shading_normal(uint32_t primitive, const Vec2& barycentric) const;
  /// The same in world space, of normals that are taken there one by one: zero if the mesh has none there.
  Vec3 shading_normal_world(uint32_t primitive, const Vec2& barycentric, const Transform& object_from_world) const;

  std::span<const MeshAttribute> attributes() const { return attributes_; }
  /// Index of the attribute `name` of any role; -1 if there is none.
  int find_attribute(std::string_view name) const;
  /// Index of the UV set or colour attribute `name` (empty: the active one); -1 if there is none.
  int find_uv(std::string_view name) const { return find_role(AttributeRole::uv, name, active_uv_); }
  int find_color(std::string_view name) const { return find_role(AttributeRole::color, name, active_color_); }

  /// Interpolated attribute. A single component counts for x, y and z (as a number becomes a colour in Blender), else
  /// missing ones are 0; w is 1 if missing.
  Vec4 attribute(int index, uint32_t primitive, const Vec2& barycentric) const;
  /// The attribute and its derivatives with respect to u and v (constant over the triangle; 0 for face values).
  struct AttributeGradient {
    Vec4 value{0, 0, 0, 1}, du{0, 0, 0, 0}, dv{0, 0, 0, 0};
  };
  AttributeGradient attribute_gradient(int index, uint32_t primitive, const Vec2& barycentric) const;

  /// Blender's Generated coordinates of an object-space point.
  Vec3 generated(const Vec3& p_object) const;

  /// Unit tangent (direction of growing first coordinate of a UV set) interpolated over smooth corners, and in w the
  /// sign (+1 or -1) of the bitangent: bitangent = w · cross(shading_normal, tangent). `index` from find_uv(); the zero
  /// vector where the UVs are degenerate. The first call for a UV set computes it for the whole mesh;
  /// prepare_tangents() does so beforehand. Displaced meshes have those from before.
  Vec4 tangent(int index, uint32_t primitive, const Vec2& barycentric) const;
  void prepare_tangents(int index) const;

 private:
  TriangleMesh();
  void leave_out_unusable(Report& report);
  void check_attributes(Report& report);
  int find_role(AttributeRole role, std::string_view name, const std::string& active) const;
  std::array<size_t, 3> elements(AttributeDomain domain, uint32_t primitive) const;
  /// The normals of a triangle's corners; there are some.
  std::array<Vec3, 3> corner_normals(uint32_t primitive) const;

  struct Tangents;

  std::string name_, active_uv_, active_color_;
  uint32_t triangle_count_ = 0, vertex_count_ = 0, max_material_slot_ = 0;
  uint32_t max_corner_ = 0, max_face_ = 0;
  uint64_t dropped_triangles_ = 0;
  size_t bytes_ = 0;
  Bounds3 bounds_;
  SharedSpan<float> positions_;
  SharedSpan<uint32_t> triangles_, triangle_corners_, triangle_faces_;
  SharedSpan<uint16_t> triangle_materials_;
  SharedSpan<float> normals_;
  AttributeDomain normals_domain_ = AttributeDomain::corner;
  std::vector<MeshAttribute> attributes_;
  Vec3 texture_space_location_{0.0f}, texture_space_size_{1.0f};
  std::shared_ptr<const TriangleMesh> undisplaced_;  ///< null: itself
  std::vector<std::shared_ptr<Tangents>> tangents_;  ///< by attribute; made once when first asked for
};

}  // namespace lambent
