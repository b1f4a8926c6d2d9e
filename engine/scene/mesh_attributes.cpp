#include "engine/scene/mesh_attributes.h"

#include <algorithm>

#include "engine/base/frame.h"

namespace lambent {

namespace {

Vec4 widened(const Vec3& v, float w) { return {v.x, v.y, v.z, w}; }

Vec3 to_world(const ShadingPoint& point, const Vec3& v_object) { return point.world_from_object->vector(v_object); }

void fill_generated(const MeshPoint& at, const ShadingPoint& point, bool differentials, AttributeValue& value) {
  const TriangleMesh& mesh = at.mesh.undisplaced();
  Vec3 p, dpdx(0.0f), dpdy(0.0f);
  if (&mesh == &at.mesh) {
    p = point.object_from_world->point(point.p_world);
    if (differentials) {
      dpdx = point.object_from_world->vector(point.dpdx_world);
      dpdy = point.object_from_world->vector(point.dpdy_world);
    }
  } else {
    const Triangle corners = mesh.triangle(at.primitive);
    const Vec3 u = corners[1] - corners[0], v = corners[2] - corners[0];
    p = corners[0] + u * at.barycentric.x + v * at.barycentric.y;
    dpdx = u * at.dx.x + v * at.dx.y;
    dpdy = u * at.dy.x + v * at.dy.y;
  }
  const Vec3 generated = mesh.generated(p);
  value = AttributeValue::constant(widened(generated, 1.0f));
  if (!differentials) return;
  value.ddx = widened(mesh.generated(p + dpdx) - generated, 0.0f);
  value.ddy = widened(mesh.generated(p + dpdy) - generated, 0.0f);
}

/// @param compact: AttributeRequest::Kind::undisplaced
void fill_undisplaced(const MeshPoint& at, const ShadingPoint& point, bool differentials, bool compact,
                      AttributeValue& value) {
  const TriangleMesh& mesh = at.mesh.undisplaced();
  if (&mesh == &at.mesh) {
    value = {widened(point.p_world + point.origin_shift, 1.0f), widened(point.dpdx_world, 0.0f),
             widened(point.dpdy_world, 0.0f)};
    return;
  }
  const Triangle corners = mesh.triangle(at.primitive);
  const Vec3 u = corners[1] - corners[0], v = corners[2] - corners[0];
  const Vec3 p = point.world_from_object->point(corners[0] + u * at.barycentric.x + v * at.barycentric.y);
  value = AttributeValue::constant(widened(p + point.origin_shift, 1.0f));
  if (!differentials) return;
  Vec3 dpdx = to_world(point, u * at.dx.x + v * at.dx.y), dpdy = to_world(point, u * at.dy.x + v * at.dy.y);
  if (compact) footprint(point.ng_world, 0.5f * (length(dpdx) + length(dpdy)), dpdx, dpdy);
  value.ddx = widened(dpdx, 0.0f);
  value.ddy = widened(dpdy, 0.0f);
}

void fill_value(const MeshPoint& at, const AttributeRequest& request, int index, bool differentials,
                AttributeValue& value) {
  if (index < 0) {
    const bool other = request.kind == AttributeRequest::Kind::named;
    value = AttributeValue::constant(Vec4(0.0f, 0.0f, 0.0f, other ? 1.0f : 0.0f));
    return;
  }
  if (differentials) {
    const TriangleMesh::AttributeGradient gradient = at.mesh.attribute_gradient(index, at.primitive, at.barycentric);
    value.value = gradient.value;
    value.ddx = gradient.du * at.dx.x + gradient.dv * at.dx.y;
    value.ddy = gradient.du * at.dy.x + gradient.dv * at.dy.y;
  } else {
    value = AttributeValue::constant(at.mesh.attribute(index, at.primitive, at.barycentric));
  }
  if (request.kind != AttributeRequest::Kind::number) return;
  const int components = at.mesh.attributes()[static_cast<size_t>(index)].components;
  for (Vec4* v : {&value.value, &value.ddx, &value.ddy}) v->x = as_number(*v, components);
}

}  // namespace

void footprint(const Vec3& n, float width_m, Vec3& dpdx, Vec3& dpdy) {
  const Vec3 diagonal = cross(Vec3(1.0f), n);
  const float sine = length(diagonal);
  dpdx = sine > 1e-4f ? diagonal * (width_m / sine) : Frame::from_normal(n).s * width_m;
  dpdy = cross(n, dpdx);
}

void fill_attributes(const MeshPoint& at, std::span<const AttributeRequest> requests, const AttributeIndices& indices,
                     std::span<const Vec4> object_values, bool differentials, ShadingPoint& point) {
  for (size_t i = 0; i < requests.size() && i < k_max_attributes; ++i) {
    AttributeValue& value = point.attributes[i];
    const int index = indices[i];
    switch (requests[i].kind) {
      case AttributeRequest::Kind::generated:
        fill_generated(at, point, differentials, value);
        break;
      case AttributeRequest::Kind::undisplaced:
        fill_undisplaced(at, point, differentials, requests[i].name == "compact", value);
        break;
      case AttributeRequest::Kind::undisplaced_normal: {
        const Vec3 n_object = at.mesh.undisplaced().shading_normal(at.primitive, at.barycentric);
        const Vec3 n = normalize(point.object_from_world->transposed_vector(n_object));
        value = AttributeValue::constant(widened(point.backfacing ? -n : n, 0.0f));
        if (length_squared(n) == 0.0f) value = AttributeValue::constant(widened(point.ns_world, 0.0f));
        break;
      }
      case AttributeRequest::Kind::tangent: {
        value = AttributeValue::constant(Vec4(0.0f));
        if (index < 0) break;
        const Vec4 tangent = at.mesh.tangent(index, at.primitive, at.barycentric);
        const Vec3 world = normalize(to_world(point, {tangent.x, tangent.y, tangent.z}));
        value.value = widened(world, at.mirrored ? -tangent.w : tangent.w);
        break;
      }
      case AttributeRequest::Kind::object:
        value = AttributeValue::constant(index < 0 ? Vec4(0.0f) : object_values[static_cast<size_t>(index)]);
        break;
      default:
        fill_value(at, requests[i], index, differentials, value);
    }
  }
}

}  // namespace lambent
