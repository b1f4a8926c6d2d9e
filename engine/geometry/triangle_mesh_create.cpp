// Validation of meshes: what cannot be used is left out and reported, the rest is shared, not copied.
#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <atomic>

#include "engine/geometry/tangents.h"
#include "engine/geometry/triangle_mesh.h"

namespace lambent {

namespace {

/// Coordinates from here on would overflow in squares and cubes during intersection; Embree refuses them too.
constexpr float k_coordinate_limit = 1e18f;
/// Primitive and vertex numbers are 32 bits, and the last one means "none".
constexpr size_t k_count_limit = 0xfffffffeu;
constexpr size_t k_grain = 1 << 15;

bool usable(const float* p) {
  // False for NaN as well.
  return std::fabs(p[0]) < k_coordinate_limit && std::fabs(p[1]) < k_coordinate_limit &&
         std::fabs(p[2]) < k_coordinate_limit;
}

template <typename T>
bool aligned(const SharedSpan<T>& span) {
  return reinterpret_cast<uintptr_t>(span.values.data()) % alignof(T) == 0;
}

/// What one pass over the triangles finds.
struct Findings {
  uint64_t bad_indices = 0, bad_vertices = 0, degenerate = 0;
  uint32_t first_bad = 0xffffffffu;
  uint32_t max_corner = 0, max_face = 0, max_slot = 0;
  Bounds3 bounds;

  Findings& operator+=(const Findings& other) {
    bad_indices += other.bad_indices;
    bad_vertices += other.bad_vertices;
    degenerate += other.degenerate;
    first_bad = std::min(first_bad, other.first_bad);
    max_corner = std::max(max_corner, other.max_corner);
    max_face = std::max(max_face, other.max_face);
    max_slot = std::max(max_slot, other.max_slot);
    bounds.extendBy(other.bounds);
    return *this;
  }
  uint64_t bad() const { return bad_indices + bad_vertices; }
};

enum class Use { good, bad_index, bad_vertex };

Use triangle_use(const float* positions, size_t vertex_count, const uint32_t* index) {
  if (index[0] >= vertex_count || index[1] >= vertex_count || index[2] >= vertex_count) return Use::bad_index;
  for (int k = 0; k < 3; ++k)
    if (!usable(positions + 3 * size_t(index[k]))) return Use::bad_vertex;
  return Use::good;
}

/// Keeps the rows (of `width` elements) of `span` that `kept` names.
template <typename T>
void select_rows(SharedSpan<T>& span, const std::vector<uint32_t>& kept, size_t width) {
  std::vector<T> rows;
  rows.reserve(kept.size() * width);
  for (const uint32_t row : kept)
    for (size_t i = 0; i < width; ++i) rows.push_back(span[row * width + i]);
  span = SharedSpan<T>(std::move(rows));
}

const char* domain_name(AttributeDomain domain) {
  switch (domain) {
    case AttributeDomain::vertex:
      return "vertices";
    case AttributeDomain::corner:
      return "corners";
    case AttributeDomain::face:
      return "faces";
  }
  return "";
}

}  // namespace

TriangleMesh::TriangleMesh() = default;
TriangleMesh::~TriangleMesh() = default;

std::shared_ptr<const TriangleMesh> TriangleMesh::create(MeshInput input, Report& report) {
  std::shared_ptr<TriangleMesh> mesh(new TriangleMesh);
  mesh->name_ = std::move(input.name);
  mesh->active_uv_ = std::move(input.active_uv);
  mesh->active_color_ = std::move(input.active_color);
  mesh->texture_space_location_ = input.texture_space_location;
  mesh->texture_space_size_ = input.texture_space_size;
  const std::string& name = mesh->name_;
  const auto complain = [&](std::string text) {
    report.warning("invalid_mesh", name, fmt::format("Mesh '{}': {}", name, text));
  };

  const size_t triangles = input.triangles.size() / 3, vertices = input.positions.size() / 3;
  if (input.positions.size() % 3 != 0 || input.triangles.size() % 3 != 0 || triangles > k_count_limit ||
      vertices > k_count_limit || !aligned(input.positions) || !aligned(input.triangles)) {
    complain(fmt::format(
        "it is left out, because its arrays are malformed ({} coordinates, {} triangle indices; both must be "
        "multiples of 3, fewer than 4 billion rows, and aligned to 4 bytes).",
        input.positions.size(), input.triangles.size()));
    return mesh;
  }
  if (triangles == 0) return mesh;  // the objects that show it are named by the scene
  mesh->vertex_count_ = static_cast<uint32_t>(vertices);
  mesh->triangle_count_ = static_cast<uint32_t>(triangles);
  mesh->positions_ = std::move(input.positions);
  mesh->triangles_ = std::move(input.triangles);

  const auto per_triangle = [&](auto& span, size_t width, const char* what) {
    if (span.empty() || (span.size() == width * triangles && aligned(span))) return;
    complain(fmt::format("its {} are ignored: {} values for {} triangles, {} expected.", what, span.size(), triangles,
                         width * triangles));
    span = {};
  };
  per_triangle(input.triangle_corners, 3, "corner indices");
  per_triangle(input.triangle_faces, 1, "face indices");
  per_triangle(input.triangle_materials, 1, "material slots");
  mesh->triangle_corners_ = std::move(input.triangle_corners);
  mesh->triangle_faces_ = std::move(input.triangle_faces);
  mesh->triangle_materials_ = std::move(input.triangle_materials);
  mesh->normals_ = std::move(input.normals);
  mesh->normals_domain_ = input.normals_domain;
  mesh->attributes_ = std::move(input.attributes);

  mesh->leave_out_unusable(report);
  mesh->check_attributes(report);

  // Embree reads 16 bytes at the last vertex, 4 more than it has. They are there unless the array ends with its page.
  constexpr uintptr_t k_page = 4096;
  if (reinterpret_cast<uintptr_t>(mesh->positions_.values.data() + mesh->positions_.size()) % k_page == 0) {
    std::vector<float> copy;
    copy.reserve(mesh->positions_.size() + 1);
    copy.assign(mesh->positions_.values.begin(), mesh->positions_.values.end());
    copy.push_back(0.0f);
    SharedSpan<float> padded(std::move(copy));
    padded.values = padded.values.first(padded.size() - 1);
    mesh->positions_ = std::move(padded);
  }

  const auto bytes = [](const auto& span) { return span.values.size_bytes(); };
  mesh->bytes_ = sizeof(TriangleMesh) + bytes(mesh->positions_) + bytes(mesh->triangles_) +
                 bytes(mesh->triangle_corners_) + bytes(mesh->triangle_faces_) + bytes(mesh->triangle_materials_) +
                 bytes(mesh->normals_);
  for (const MeshAttribute& attribute : mesh->attributes_) mesh->bytes_ += bytes(attribute.values);
  mesh->tangents_.reserve(mesh->attributes_.size());
  for (size_t i = 0; i < mesh->attributes_.size(); ++i) mesh->tangents_.push_back(std::make_shared<Tangents>());
  return mesh;
}

std::shared_ptr<const TriangleMesh> TriangleMesh::create_displaced(std::shared_ptr<const TriangleMesh> mesh,
                                                                   std::vector<float> positions,
                                                                   std::vector<float> normals, Report& report) {
  MeshInput input;
  input.name = mesh->name_;
  input.positions = SharedSpan<float>(std::move(positions));
  input.triangles = mesh->triangles_;
  input.triangle_corners = mesh->triangle_corners_;
  input.triangle_faces = mesh->triangle_faces_;
  input.triangle_materials = mesh->triangle_materials_;
  if (!normals.empty()) input.normals = SharedSpan<float>(std::move(normals));
  input.normals_domain = mesh->normals_domain_;
  input.attributes = mesh->attributes_;
  input.active_uv = mesh->active_uv_;
  input.active_color = mesh->active_color_;
  input.texture_space_location = mesh->texture_space_location_;
  input.texture_space_size = mesh->texture_space_size_;
  const auto made = std::const_pointer_cast<TriangleMesh>(create(std::move(input), report));
  made->undisplaced_ = std::move(mesh);
  return made;
}

void TriangleMesh::leave_out_unusable(Report& report) {
  const float* positions = positions_.values.data();
  const uint32_t* indices = triangles_.values.data();
  const auto scan = [&] {
    return tbb::parallel_deterministic_reduce(
        tbb::blocked_range<uint32_t>(0, triangle_count_, k_grain), Findings{},
        [&](const tbb::blocked_range<uint32_t>& range, Findings found) {
          for (uint32_t t = range.begin(); t != range.end(); ++t) {
            const uint32_t* index = indices + 3 * size_t(t);
            const Use use = triangle_use(positions, vertex_count_, index);
            if (use != Use::good) {
              ++(use == Use::bad_index ? found.bad_indices : found.bad_vertices);
              found.first_bad = std::min(found.first_bad, t);
              continue;
            }
            const Triangle p = triangle(t);
            for (const Vec3& vertex : p) found.bounds.extendBy(vertex);
            if (cross(p[1] - p[0], p[2] - p[0]) == Vec3(0.0f) && is_degenerate(t)) ++found.degenerate;
            const auto [a, b, c] = corners(t);
            found.max_corner = std::max({found.max_corner, a, b, c});
            found.max_face = std::max(found.max_face, face(t));
            found.max_slot = std::max(found.max_slot, material_slot(t));
          }
          return found;
        },
        [](Findings a, const Findings& b) { return a += b; });
  };
  Findings found = scan();
  if (found.bad() > 0) {
    std::vector<uint32_t> kept;
    kept.reserve(triangle_count_ - found.bad());
    for (uint32_t t = 0; t < triangle_count_; ++t)
      if (triangle_use(positions, vertex_count_, indices + 3 * size_t(t)) == Use::good) kept.push_back(t);
    const auto tell = [&](uint64_t count, const char* why) {
      if (count > 0)
        report.warning("invalid_mesh", name_,
                       fmt::format("Mesh '{}': {} of {} triangles are left out because {} (the first is number {}).",
                                   name_, count, triangle_count_, why, found.first_bad));
    };
    tell(found.bad_indices, "a vertex index is out of range");
    tell(found.bad_vertices, "a vertex position is NaN, infinite or beyond 1e18 m");
    dropped_triangles_ = found.bad();
    // Numbers that were implied by a triangle's place must be kept when it moves.
    if (triangle_corners_.empty()) {
      std::vector<uint32_t> explicit_corners;
      explicit_corners.reserve(3 * kept.size());
      for (const uint32_t t : kept)
        for (uint32_t k = 0; k < 3; ++k) explicit_corners.push_back(3 * t + k);
      triangle_corners_ = SharedSpan<uint32_t>(std::move(explicit_corners));
    } else {
      select_rows(triangle_corners_, kept, 3);
    }
    if (triangle_faces_.empty())
      triangle_faces_ = SharedSpan<uint32_t>(std::vector<uint32_t>(kept));
    else
      select_rows(triangle_faces_, kept, 1);
    if (!triangle_materials_.empty()) select_rows(triangle_materials_, kept, 1);
    select_rows(triangles_, kept, 3);
    triangle_count_ = static_cast<uint32_t>(kept.size());
    indices = triangles_.values.data();
  }
  if (found.degenerate > 0)
    report.info("degenerate_triangles", name_,
                fmt::format("Mesh '{}': {} of {} triangles have no area; they are invisible and emit no light.", name_,
                            found.degenerate, triangle_count_));
  bounds_ = found.bounds;
  max_material_slot_ = found.max_slot;
  max_corner_ = found.max_corner;
  max_face_ = found.max_face;
}

void TriangleMesh::check_attributes(Report& report) {
  const auto needed = [&](AttributeDomain domain) -> size_t {
    if (triangle_count_ == 0) return 0;
    if (domain == AttributeDomain::vertex) return vertex_count_;
    return size_t(domain == AttributeDomain::corner ? max_corner_ : max_face_) + 1;
  };
  const auto fits = [&](const std::string& what, const SharedSpan<float>& values, int components,
                        AttributeDomain domain) {
    if (components >= 1 && components <= 4 && values.size() % size_t(components) == 0 && aligned(values) &&
        values.size() / size_t(components) >= needed(domain))
      return true;
    report.warning("invalid_mesh", name_,
                   fmt::format("Mesh '{}': {} is ignored: {} values of {} components for {} {}.", name_, what,
                               values.size(), components, needed(domain), domain_name(domain)));
    return false;
  };
  if (!normals_.empty() &&
      (normals_domain_ == AttributeDomain::face || !fits("the normals array", normals_, 3, normals_domain_)))
    normals_ = {};
  std::erase_if(attributes_, [&](const MeshAttribute& attribute) {
    return !fits(fmt::format("attribute '{}'", attribute.name), attribute.values, attribute.components,
                 attribute.domain);
  });
}

}  // namespace lambent
