// Perspective and orthographic cameras with a thin lens, in both transport directions.
//
// Raster space: pixels of the full frame, x to the right, y up, (0, 0) the lower left corner of pixel (0, 0). A border
// region changes nothing here: its pixels keep their coordinates in the full frame.
//
// Importance. A pixel j with a filter h_j (normalised over raster, px⁻²) measures I_j = ∫ h_j(raster) L(ray(raster,
// lens)) draster dlens / A_lens. So everything here is for unit raster density; multiply by h_j(raster). All cameras
// then share one number, J = "px² per square metre at p, perpendicular to the ray": it is the area density with which
// sample_ray hits a surface that faces the lens (for raster density 1 px⁻²), and the weight of a connection from p to a
// lens point that was drawn uniformly, because We · cos / (d² · pdf_lens) = J.
#pragma once

#include <string>

#include "engine/base/report.h"
#include "engine/base/result.h"
#include "engine/base/transform.h"
#include "engine/base/vec.h"
#include "engine/sampling/warp.h"

namespace lambent {

enum class Projection : uint8_t { perspective, orthographic };
enum class SensorFit : uint8_t { automatic, horizontal, vertical };

/// What a camera is made of, in Blender's terms. Defaults are Blender's.
struct CameraSpec {
  std::string name = "Camera";  ///< for messages
  Projection projection = Projection::perspective;
  Transform world_from_camera;            ///< looks along -Z, Y up; scale is ignored, axes need not be orthogonal
  int width_px = 1920, height_px = 1080;  ///< full frame
  Vec2 pixel_aspect{1.0f, 1.0f};
  float focal_length_mm = 50.0f, sensor_width_mm = 36.0f, sensor_height_mm = 24.0f;
  SensorFit sensor_fit = SensorFit::automatic;
  float ortho_scale = 6.0f;
  Vec2 shift{0.0f, 0.0f};
  float clip_near_m = 0.1f, clip_far_m = 1000.0f;
  bool depth_of_field = false;
  float focus_distance_m = 10.0f;
  float fstop = 2.8f;
  int blades = 0;
  float rotation_rad = 0.0f;
  float aperture_ratio = 1.0f;
};

/// Why there is no depth of field although `spec` asks for it (f-stop, focus distance or ratio not > 0, rotation not
/// finite); else empty.
std::string lens_problem(const CameraSpec& spec);

/// A ray into the scene. `origin + t * direction` for t in [t_min, t_max] is visible (clipping). Its cone
/// (Akenine-Möller 2019) has width `width_px_m + spread * t`: the extent of one pixel there.
struct CameraRay {
  Vec3 origin{0.0f};     ///< on the lens, world space
  Vec3 direction{0.0f};  ///< unit, world space
  float t_min = 0.0f, t_max = 0.0f;
  float time = 0.0f;
  float width_m = 0.0f;  ///< pixel extent at the origin, m (orthographic)
  float spread = 0.0f;   ///< growth of the pixel extent per metre
};

/// Densities of sample_ray at one of its rays, for raster density 1 px⁻².
struct CameraPdf {
  bool valid = false;          ///< the ray passes the lens opening, points forwards and crosses a raster position
  bool delta_lens = true;      ///< pinhole (perspective) or parallel rays (orthographic): see below
  Vec2 raster_px{0.0f, 0.0f};  ///< may lie outside the frame
  /// Of the origin on the lens, m⁻²; 1 (discrete) for a pinhole; for orthographic cameras of the origin on the image
  /// plane, px² m⁻².
  float pdf_lens_area = 0.0f;
  /// Of the direction given the origin, px² sr⁻¹; orthographic: sr⁻¹, or 1 (discrete) for parallel rays.
  float pdf_direction_solid_angle = 0.0f;
  float importance = 0.0f;  ///< We: px² m⁻² sr⁻¹, or without the measure of a delta part;
                            ///< We · cos = pdf_lens_area · pdf_direction_solid_angle
  float cos_lens = 0.0f;    ///< between direction and optical axis
};

/// A connection from a point in the scene to the camera.
struct CameraConnection {
  bool valid = false;  ///< in front, within the clipping range, finite. The raster position may lie outside the frame
  Vec3 p_lens_world{0.0f};     ///< end of the shadow ray
  Vec3 direction_world{0.0f};  ///< unit, from the point towards the camera
  float distance_m = 0.0f;     ///< to p_lens_world
  float t_visible_m = 0.0f;  ///< what must be unoccluded: from the point up to this distance (the near clipping plane)
  Vec2 raster_px{0.0f, 0.0f};
  float importance_px2_per_m2 = 0.0f;  ///< J of the file's comment. Splat value: throughput · f · |cos at p| · J · h_j
};

/// Immutable. No virtual calls, no allocation per ray.
class Camera {
 public:
  /// Fails, naming the camera and the parameter, for values that define no picture: a singular or non-finite transform,
  /// focal length, sensor, ortho scale, pixel aspect, frame size not > 0, near clipping plane not >= 0 or not before
  /// the far one. With a lens_problem() everything is in focus.
  static Result<Camera> create(const CameraSpec& spec);

  /// Ray through `raster_px` from lens position `u_lens` in [0, 1)²; `time` is handed on. Every raster position gives a
  /// ray (also outside the frame). As Cycles 3.4 (kernel/camera/camera.h): clipping distances are measured along the
  /// optical axis for the ray through the lens centre.
  CameraRay sample_ray(const Vec2& raster_px, const Vec2& u_lens, float time = 0.0f) const;

  /// Densities and importance of a ray that leaves the lens at `origin` along `direction` (unit). Orthographic cameras
  /// without lens accept any ray parallel to the axis.
  CameraPdf pdf(const Vec3& origin_world, const Vec3& direction_world) const;

  /// Connects p to a lens point drawn with `u_lens`.
  CameraConnection project(const Vec3& p_world, const Vec2& u_lens) const;
  /// Connects p to the given lens point (the origin of one of sample_ray's rays); J there is the area density with
  /// which that lens point's rays hit p: pdf per unit perpendicular area, px² m⁻².
  CameraConnection connect(const Vec3& p_world, const Vec3& p_lens_world) const;

  /// Raster position of a point, as the lens' centre sees it: also of points behind the camera, mirrored, and (0, 0) of
  /// those in its plane.
  Vec2 raster_of(const Vec3& p_world) const {
    const Vec3 q = p_world - origin_;
    const Vec3 raster(dot(raster_x_, q), dot(raster_y_, q), dot(dual_z_, q));
    if (projection_ == Projection::orthographic) return {raster.x + raster_of_axis_.x, raster.y + raster_of_axis_.y};
    if (raster.z == 0.0f) return {0.0f, 0.0f};
    const float per_z = 1.0f / raster.z;
    return {raster.x * per_z + raster_of_axis_.x, raster.y * per_z + raster_of_axis_.y};
  }

  /// World space to the camera's: x right, y up, z along the optical axis.
  Transform camera_from_world() const;
  /// What takes image-plane coordinates ((x, y) / z in perspective, else (x, y)) to [0, 1]² across the frame:
  /// offset + scale · plane.
  void window(Vec2& scale, Vec2& offset) const;

  Projection projection() const { return projection_; }
  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }
  /// Radius of the lens, m; 0: none.
  float lens_radius_m() const { return lens_radius_; }
  /// Unit, world space.
  Vec3 optical_axis() const { return axis_z_; }
  Vec3 origin() const { return origin_; }
  float clip_near_m() const { return near_; }
  float clip_far_m() const { return far_; }

 private:
  Camera() = default;

  Vec3 to_camera(const Vec3& v_world) const {
    return {dot(dual_x_, v_world), dot(dual_y_, v_world), dot(dual_z_, v_world)};
  }
  Vec3 to_world(const Vec3& v_camera) const {
    return axis_x_ * v_camera.x + axis_y_ * v_camera.y + axis_z_ * v_camera.z;
  }
  /// Image-plane position (at z = 1, or on the near plane) of a raster position, and back.
  Vec2 plane_of_raster(const Vec2& raster_px) const;
  Vec2 raster_of_plane(const Vec2& plane) const {
    return {(plane.x - plane_min_.x) / plane_per_px_.x, (plane.y - plane_min_.y) / plane_per_px_.y};
  }

  Projection projection_ = Projection::perspective;
  Vec3 origin_{0.0f};
  Vec3 axis_x_{1, 0, 0}, axis_y_{0, 1, 0}, axis_z_{0, 0, -1};  ///< unit columns, z forwards
  Vec3 dual_x_{1, 0, 0}, dual_y_{0, 1, 0}, dual_z_{0, 0, -1};  ///< rows of the inverse
  int width_px_ = 0, height_px_ = 0;
  Vec2 plane_min_{0.0f, 0.0f}, plane_per_px_{1.0f, 1.0f};
  Vec3 raster_x_{1, 0, 0}, raster_y_{0, 1, 0};  ///< as dual_x_ and dual_y_, but in px
  Vec2 raster_of_axis_{0.0f, 0.0f};
  float px2_per_plane_ = 1.0f;  ///< raster area per image-plane area
  float volume_ = 1.0f;         ///< determinant of the axes: 1 unless sheared
  float base_ = 1.0f;           ///< area that the x and y axes span: 1 unless sheared
  float near_ = 0.0f, far_ = 0.0f;
  float lens_radius_ = 0.0f, focus_ = 0.0f;
  Aperture aperture_;
};

}  // namespace lambent
