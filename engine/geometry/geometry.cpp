// Queries. For the error bounds below, u = 2^-24 is the unit roundoff of float; constants count the roundings of the
// longest chain of operations and are rounded up; engine/geometry/bounce_test.cpp measures that they suffice.
#include "engine/geometry/geometry.h"

#include <xmmintrin.h>

#include <limits>

#include "engine/geometry/geometry_scenes.h"

namespace lambent {

namespace {

constexpr float k_roundoff = 0x1p-24f;

Vec3 absolute_vector(const Transform& t, const Vec3& v) {
  Vec3 result(0.0f);
  for (int i = 0; i < 3; ++i)
    result[i] = std::fabs(t.m[i][0]) * v.x + std::fabs(t.m[i][1]) * v.y + std::fabs(t.m[i][2]) * v.z;
  return result;
}

/// Distance, in units of the roundoff, by which Embree's robust intersection of a triangle may be off for rays that
/// start on it. Its vertices are taken relative to the origin, so errors scale with the triangle's extents E, not with
/// its coordinates: n·E from the dot product, and ExEyEz / 2A from the cross product that is its normal.
float intersection_error(const Vec3& extent, const Vec3& n, float twice_area) {
  const float largest = max_component(extent);
  // Slivers: beyond an aspect of 32 the bound would visibly detach shadows; such triangles are hardly ever hit.
  const float normal_error = std::min(extent.x * extent.y / twice_area * extent.z, 32.0f * largest);
  return 12.0f * (dot(abs(n), extent) + 6.0f * normal_error) + largest;
}

/// Barycentrics moved off the edges by what rounding may move the point across them: a point outside its triangle would
/// be behind the neighbouring wall. `inset`: that distance over the smallest height.
void keep_inside(double& u, double& v, double inset) {
  double w = 1.0 - u - v;
  inset = std::min(inset, 1.0 / 3.0);
  u = std::max(u, inset);
  v = std::max(v, inset);
  w = std::max(w, inset);
  const double sum = u + v + w;
  u /= sum;
  v /= sum;
}

}  // namespace

Geometry::Geometry() = default;
Geometry::~Geometry() = default;

bool Geometry::intersect(const Ray& ray, Hit& hit) const {
  return scenes_ && embree::closest_hit(scenes_->top->get(), ray, hit);
}

bool Geometry::intersect_instance(Ray& ray, uint32_t instance, Hit& hit, uint64_t* rays) const {
  constexpr int k_most_others = 64;
  for (int others = 0; others < k_most_others; ++others) {
    if (rays) ++*rays;
    Hit nearest;
    if (!intersect(ray, nearest)) return false;
    ray.t_min = std::nextafter(nearest.t, std::numeric_limits<float>::infinity());
    if (nearest.instance == instance) {
      hit = nearest;
      return true;
    }
  }
  return false;
}

bool Geometry::occluded(const Ray& ray) const {
  return scenes_ && embree::any_hit(scenes_->top->get(), ray, ray.mask & k_visible_all);
}

bool Geometry::occluded_visiting(const Ray& ray, bool (*visit)(void*, const Hit&), void* context) const {
  if (!scenes_) return false;
  const uint32_t mask = ray.mask & k_visible_all;
  if (!has_transparent_shadows()) return embree::any_hit(scenes_->top->get(), ray, mask);
  if (embree::any_hit(scenes_->top->get(), ray, mask << k_opaque_shift)) return true;
  struct Visitor {
    const Geometry* geometry;
    bool (*visit)(void*, const Hit&);
    void* context;
  } visitor{this, visit, context};
  return embree::any_hit_visiting(
      scenes_->top->get(), ray, mask << k_transparent_shift,
      [](void* pointer, const Hit& hit) {
        const auto* self = static_cast<const Visitor*>(pointer);
        const Instance& instance = self->geometry->instances_[hit.instance];
        if (const auto& opaque = self->geometry->opaque_slots_[instance.object]) {
          const uint32_t slot = instance.mesh->material_slot(hit.primitive);
          if (slot < opaque->size() && (*opaque)[slot]) return false;
        }
        return self->visit(self->context, hit);
      },
      &visitor);
}

Triangle Geometry::triangle_world(uint32_t index, uint32_t primitive) const {
  const Instance& instance = instances_[index];
  if (!instance.positions_world) {
    Triangle p = instance.mesh->triangle(primitive);
    for (Vec3& vertex : p) vertex = instance.world_from_object.point(vertex);
    return p;
  }
  Triangle p;
  const auto vertices = instance.mesh->vertices(primitive);
  for (size_t k = 0; k < 3; ++k) {
    const float* vertex = instance.positions_world + 3 * size_t(vertices[k]);
    p[k] = {vertex[0], vertex[1], vertex[2]};
  }
  return p;
}

SurfaceHit Geometry::surface(uint32_t index, uint32_t primitive, const Vec2& barycentric) const {
  const Instance& instance = instances_[index];
  const bool flattened = instance.positions_world != nullptr;
  const Transform& to_world = instance.world_from_object;
  // The triangle as Embree meets it: in the world if flattened, else in object space.
  const Triangle p = flattened ? triangle_world(index, primitive) : instance.mesh->triangle(primitive);

  SurfaceHit point;
  point.barycentric = barycentric;
  point.instance = index;
  point.primitive = primitive;
  point.mesh = instance.mesh;
  point.material_slot = instance.mesh->material_slot(primitive);

  // In double: exact differences and products of floats, so that slivers have the right normal and only the final
  // rounding counts.
  const Vec3d p0(p[0]), e1 = Vec3d(p[1]) - p0, e2 = Vec3d(p[2]) - p0;
  const Vec3d cross_product = e1.cross(e2);
  const double twice_area = std::sqrt(cross_product.dot(cross_product));
  const Vec3 n = twice_area > 0.0 ? Vec3(cross_product * (1.0 / twice_area)) : Vec3(0, 0, 1);

  Vec3 largest_vertex, extent;
  for (int i = 0; i < 3; ++i) {
    const float least = std::min({p[0][i], p[1][i], p[2][i]}), most = std::max({p[0][i], p[1][i], p[2][i]});
    largest_vertex[i] = std::max(-least, most);
    extent[i] = most - least;
  }
  // Magnitudes of what is added up on the way from the world to object space: they bound rounding there.
  Vec3 object_magnitude = largest_vertex;
  if (!flattened) {
    const Vec3 world_magnitude = absolute_vector(to_world, largest_vertex) + abs(to_world.origin()) * 2.0f;
    object_magnitude += absolute_vector(instance.object_from_world, world_magnitude) * instance.inverse_error;
  }
  // Distance to keep from the edges: rounding of the point and of the test against the neighbour.
  const float size = extent.x + extent.y + extent.z;  // at least the longest edge
  const double inset = double(k_roundoff) * (4.0f * max_component(object_magnitude) + 8.0f * size);
  double u = barycentric.x, v = barycentric.y;
  if (std::min({u, v, 1.0 - u - v}) * twice_area < inset * size)
    keep_inside(u, v, inset * size / std::max(twice_area, 1e-300));
  const Vec3d position = p0 + e1 * u + e2 * v;

  float error = intersection_error(extent, n, static_cast<float>(twice_area));
  if (flattened) {
    point.p_world = Vec3(position);
    point.ng_world = instance.mirrored ? -n : n;
    point.dpdu_world = Vec3(e1);
    point.dpdv_world = Vec3(e2);
    error += 3.0f * dot(abs(n), abs(point.p_world));
  } else {
    for (int i = 0; i < 3; ++i)
      point.p_world[i] = static_cast<float>(to_world.m[i][0] * position.x + to_world.m[i][1] * position.y +
                                            to_world.m[i][2] * position.z + to_world.m[i][3]);
    const Vec3 normal = instance.object_from_world.transposed_vector(n);
    const float stretch = length(normal);  // object-space distances along n are 1 / stretch of the world's
    point.ng_world = normalize(normal);
    point.dpdu_world = to_world.vector(Vec3(e1));
    point.dpdv_world = to_world.vector(Vec3(e2));
    // Embree takes the origin to object space with an inverse of its own: errors of (|M⁻¹|(|p| + |t|) + |p_object|)
    // brought back to the world by |M|.
    const Vec3 world_error = absolute_vector(to_world, object_magnitude) * 4.0f + abs(point.p_world) * 2.0f;
    error = error / stretch + dot(abs(point.ng_world), world_error);
  }
  error += max_component(abs(point.p_world));
  point.p_error = k_roundoff * error;

  point.ns_world = point.ng_world;
  if (instance.mesh->has_normals()) {
    const Vec3 ns = instance.normals_at_vertices
                        ? instance.mesh->shading_normal_world(primitive, barycentric, instance.object_from_world)
                        : normalize(instance.object_from_world.transposed_vector(
                              instance.mesh->shading_normal(primitive, barycentric)));
    if (length_squared(ns) > 0.0f) point.ns_world = ns;
  }
  return point;
}

size_t Geometry::bvh_bytes() const { return scenes_ ? scenes_->device->bytes() : 0; }

DenormalsFlushed::DenormalsFlushed() : mode_(_mm_getcsr()) {
  constexpr unsigned k_flush_to_zero = 1u << 15, k_denormals_are_zero = 1u << 6;
  _mm_setcsr(mode_ | k_flush_to_zero | k_denormals_are_zero);
}

DenormalsFlushed::~DenormalsFlushed() { _mm_setcsr(mode_); }

}  // namespace lambent
