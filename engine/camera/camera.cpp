#include "engine/camera/camera.h"

#include <cmath>

namespace lambent {

namespace {

/// Half extents of the image plane (perspective: at distance 1) and how far a shift of 1 moves it.
struct ViewPlane {
  double half_x = 0.0, half_y = 0.0;
  double per_shift = 0.0;
};

/// Blender's sensor fit (blender_camera_viewplane in Cycles' Blender export).
ViewPlane view_plane_of(const CameraSpec& spec) {
  const double x = static_cast<double>(spec.width_px) * static_cast<double>(spec.pixel_aspect.x);
  const double y = static_cast<double>(spec.height_px) * static_cast<double>(spec.pixel_aspect.y);
  const bool horizontal = spec.sensor_fit == SensorFit::automatic ? x > y : spec.sensor_fit == SensorFit::horizontal;
  const double sensor =
      static_cast<double>(spec.sensor_fit == SensorFit::vertical ? spec.sensor_height_mm : spec.sensor_width_mm);
  // The fitted side spans the sensor (or ortho_scale); the other follows the frame's shape.
  const double half = spec.projection == Projection::orthographic
                          ? 0.5 * static_cast<double>(spec.ortho_scale)
                          : 0.5 * sensor / static_cast<double>(spec.focal_length_mm);
  return {horizontal ? half : half * x / y, horizontal ? half * y / x : half, 2.0 * half};
}

bool positive(float v) { return v > 0.0f && std::isfinite(v); }

std::string problem_of(const CameraSpec& spec) {
  if (!spec.world_from_camera.is_finite()) return "its transform is not finite";
  if (!spec.world_from_camera.is_invertible()) return "its transform is singular (a scale of zero)";
  if (spec.width_px <= 0 || spec.height_px <= 0) return "the frame has no pixels";
  if (!positive(spec.pixel_aspect.x) || !positive(spec.pixel_aspect.y)) return "the pixel aspect must be above 0";
  if (spec.projection == Projection::perspective) {
    if (!positive(spec.focal_length_mm)) return "its focal length must be above 0";
    if (!positive(spec.sensor_width_mm) || !positive(spec.sensor_height_mm)) return "its sensor size must be above 0";
  } else if (!positive(spec.ortho_scale)) {
    return "its orthographic scale must be above 0";
  }
  if (!std::isfinite(spec.shift.x) || !std::isfinite(spec.shift.y)) return "its shift is not finite";
  if (!(spec.clip_near_m >= 0.0f) || !(spec.clip_far_m > spec.clip_near_m))
    return "its clipping range is empty or starts below 0";
  return {};
}

}  // namespace

std::string lens_problem(const CameraSpec& spec) {
  if (!spec.depth_of_field) return {};
  if (!positive(spec.fstop)) return "its f-stop must be above 0";
  if (!positive(spec.focus_distance_m)) return "its focus distance must be above 0";
  if (!positive(spec.aperture_ratio)) return "its aperture ratio must be above 0";
  if (!std::isfinite(spec.rotation_rad)) return "its aperture rotation is not finite";
  return {};
}

Result<Camera> Camera::create(const CameraSpec& spec) {
  if (const std::string problem = problem_of(spec); !problem.empty())
    return Error{"Camera \"" + spec.name + "\": " + problem};
  Camera camera;
  camera.projection_ = spec.projection;
  camera.width_px_ = spec.width_px;
  camera.height_px_ = spec.height_px;
  camera.near_ = spec.clip_near_m;
  camera.far_ = spec.clip_far_m;

  camera.origin_ = spec.world_from_camera.origin();
  camera.axis_x_ = normalize(spec.world_from_camera.column(0));
  camera.axis_y_ = normalize(spec.world_from_camera.column(1));
  camera.axis_z_ = -normalize(spec.world_from_camera.column(2));
  const Vec3 base = cross(camera.axis_x_, camera.axis_y_);
  const float determinant = dot(base, camera.axis_z_);
  if (!(std::fabs(determinant) > 1e-6f))
    return Error{"Camera \"" + spec.name + "\": its transform is singular (the axes lie in a plane)"};
  camera.volume_ = std::fabs(determinant);
  camera.base_ = length(base);
  camera.dual_x_ = cross(camera.axis_y_, camera.axis_z_) * (1.0f / determinant);
  camera.dual_y_ = cross(camera.axis_z_, camera.axis_x_) * (1.0f / determinant);
  camera.dual_z_ = base * (1.0f / determinant);

  const ViewPlane plane = view_plane_of(spec);
  const double center_x = plane.per_shift * static_cast<double>(spec.shift.x);
  const double center_y = plane.per_shift * static_cast<double>(spec.shift.y);
  const double step_x = 2.0 * plane.half_x / spec.width_px, step_y = 2.0 * plane.half_y / spec.height_px;
  camera.plane_min_ = {static_cast<float>(center_x - plane.half_x), static_cast<float>(center_y - plane.half_y)};
  camera.plane_per_px_ = {static_cast<float>(step_x), static_cast<float>(step_y)};
  camera.raster_x_ = camera.dual_x_ * (1.0f / camera.plane_per_px_.x);
  camera.raster_y_ = camera.dual_y_ * (1.0f / camera.plane_per_px_.y);
  camera.raster_of_axis_ = camera.raster_of_plane({0.0f, 0.0f});
  camera.px2_per_plane_ = static_cast<float>(1.0 / (step_x * step_y));

  if (spec.depth_of_field && lens_problem(spec).empty()) {
    // Orthographic cameras have no focal length: Cycles takes 1 m.
    const float focal_length_m = spec.projection == Projection::perspective ? spec.focal_length_mm * 1e-3f : 1.0f;
    camera.lens_radius_ = focal_length_m / (2.0f * spec.fstop);
    camera.focus_ = spec.focus_distance_m;
    camera.aperture_ = {spec.blades, spec.rotation_rad, spec.aperture_ratio};
  }
  return camera;
}

Vec2 Camera::plane_of_raster(const Vec2& raster) const {
  return {plane_min_.x + raster.x * plane_per_px_.x, plane_min_.y + raster.y * plane_per_px_.y};
}

Transform Camera::camera_from_world() const {
  Transform result;
  const Vec3 rows[3] = {dual_x_, dual_y_, dual_z_};
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) result.m[i][k] = rows[i][k];
    result.m[i][3] = -dot(rows[i], origin_);
  }
  return result;
}

void Camera::window(Vec2& scale, Vec2& offset) const {
  const Vec2 size(static_cast<float>(width_px_), static_cast<float>(height_px_));
  for (int i = 0; i < 2; ++i) {
    scale[i] = 1.0f / (plane_per_px_[i] * size[i]);
    offset[i] = -plane_min_[i] * scale[i];
  }
}

CameraRay Camera::sample_ray(const Vec2& raster_px, const Vec2& u_lens, float time) const {
  const Vec2 plane = plane_of_raster(raster_px);
  const Vec2 lens = lens_radius_ > 0.0f ? aperture_.sample(u_lens) * lens_radius_ : Vec2(0.0f, 0.0f);
  CameraRay ray;
  ray.time = time;
  if (projection_ == Projection::perspective) {
    // Through the point of the plane of focus that the ray through the lens centre meets.
    const Vec2 tilt = lens_radius_ > 0.0f ? lens * (1.0f / focus_) : lens;
    const Vec3 w = to_world({plane.x - tilt.x, plane.y - tilt.y, 1.0f});
    const float l = length(w);
    ray.origin = origin_ + axis_x_ * lens.x + axis_y_ * lens.y;
    ray.direction = w * (1.0f / l);
    const float per_depth = std::sqrt(1.0f + plane.x * plane.x + plane.y * plane.y);
    ray.t_min = near_ * per_depth;
    ray.t_max = far_ * per_depth;
    ray.spread = std::sqrt(volume_ / (px2_per_plane_ * l * l * l));
  } else {
    const Vec2 tilt = lens_radius_ > 0.0f ? lens * (1.0f / focus_) : lens;
    const Vec3 w = to_world({-tilt.x, -tilt.y, 1.0f});
    ray.origin = origin_ + to_world({plane.x + lens.x, plane.y + lens.y, near_});
    ray.direction = normalize(w);
    ray.t_max = far_ - near_;
    ray.width_m = std::sqrt(base_ / px2_per_plane_);
  }
  return ray;
}

CameraPdf Camera::pdf(const Vec3& origin_world, const Vec3& direction_world) const {
  CameraPdf pdf;
  const Vec3 d = to_camera(direction_world);
  if (!(d.z > 0.0f)) return pdf;
  const Vec3 o = to_camera(origin_world - origin_);
  const bool lens = lens_radius_ > 0.0f;
  pdf.cos_lens = dot(direction_world, dual_z_) * volume_ / base_;
  // Solid angle that one unit of the plane z = 1 spans at this direction: det / |w|³ with w = direction / d.z.
  const float plane_per_solid_angle = 1.0f / (d.z * d.z * d.z * volume_);
  const Vec2 slope(d.x / d.z, d.y / d.z);
  Vec2 plane;
  if (projection_ == Projection::perspective) {
    pdf.delta_lens = !lens;
    plane = slope;
    pdf.pdf_lens_area = 1.0f;
    if (lens) {
      plane = slope + Vec2(o.x, o.y) * (1.0f / focus_);
      pdf.pdf_lens_area = aperture_.pdf_area(Vec2(o.x, o.y) * (1.0f / lens_radius_)) / (sqr(lens_radius_) * base_);
    }
    pdf.pdf_direction_solid_angle = px2_per_plane_ * plane_per_solid_angle;
  } else {
    pdf.delta_lens = !lens;
    // Back to the image plane, should the origin lie elsewhere on the ray.
    const Vec2 on_plane(o.x - slope.x * (o.z - near_), o.y - slope.y * (o.z - near_));
    plane = on_plane;
    pdf.pdf_lens_area = px2_per_plane_ / base_;
    pdf.pdf_direction_solid_angle = 1.0f;
    if (lens) {
      const Vec2 lens_point = slope * -focus_;
      plane = on_plane - lens_point;
      pdf.pdf_direction_solid_angle =
          aperture_.pdf_area(lens_point * (1.0f / lens_radius_)) * sqr(focus_ / lens_radius_) * plane_per_solid_angle;
    }
  }
  pdf.raster_px = raster_of_plane(plane);
  pdf.importance = pdf.pdf_lens_area * pdf.pdf_direction_solid_angle / pdf.cos_lens;
  pdf.valid = pdf.importance > 0.0f && std::isfinite(pdf.importance);
  return pdf;
}

CameraConnection Camera::project(const Vec3& p_world, const Vec2& u_lens) const {
  const Vec2 lens = lens_radius_ > 0.0f ? aperture_.sample(u_lens) * lens_radius_ : Vec2(0.0f, 0.0f);
  if (projection_ == Projection::perspective) return connect(p_world, origin_ + axis_x_ * lens.x + axis_y_ * lens.y);
  // Along the lens point's common direction to the image plane.
  const Vec3 q = to_camera(p_world - origin_);
  const Vec2 tilt = lens_radius_ > 0.0f ? lens * (1.0f / focus_) : lens;
  const float depth = q.z - near_;
  return connect(p_world, origin_ + to_world({q.x + tilt.x * depth, q.y + tilt.y * depth, near_}));
}

CameraConnection Camera::connect(const Vec3& p_world, const Vec3& p_lens_world) const {
  CameraConnection connection;
  const Vec3 from_lens = p_world - p_lens_world;
  const Vec3 q = to_camera(from_lens);
  if (!(q.z > 0.0f)) return connection;
  const float d = length(from_lens);
  const Vec3 o = to_camera(p_lens_world - origin_);
  const Vec2 slope(q.x / q.z, q.y / q.z);
  connection.p_lens_world = p_lens_world;
  connection.direction_world = from_lens * (-1.0f / d);
  connection.distance_m = d;
  float t_min = 0.0f, t_max = far_ - near_;
  Vec2 plane;
  if (projection_ == Projection::perspective) {
    plane = lens_radius_ > 0.0f ? slope + Vec2(o.x, o.y) * (1.0f / focus_) : slope;
    const float per_depth = std::sqrt(1.0f + plane.x * plane.x + plane.y * plane.y);
    t_min = near_ * per_depth;
    t_max = far_ * per_depth;
    // Plane area per solid angle is |w|³ / det with |w| = d / q.z; over d² that is d / (q.z³ det).
    connection.importance_px2_per_m2 = px2_per_plane_ / volume_ * (d / q.z) / (q.z * q.z);
  } else {
    plane = Vec2(o.x, o.y);
    if (lens_radius_ > 0.0f) plane = plane + slope * focus_;
    connection.importance_px2_per_m2 = px2_per_plane_ / volume_ * (d / q.z);
  }
  connection.raster_px = raster_of_plane(plane);
  connection.t_visible_m = d - t_min;
  connection.valid = d >= t_min && d <= t_max && std::isfinite(connection.importance_px2_per_m2) &&
                     std::isfinite(connection.raster_px.x) && std::isfinite(connection.raster_px.y);
  return connection;
}

}  // namespace lambent
