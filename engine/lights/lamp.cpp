#include "engine/lights/lamp.h"

#include <algorithm>
#include <cmath>

#include "engine/sampling/warp.h"

namespace lambent {

namespace {

constexpr float k_least_spread_rad = 0.01f * k_pi / 180.0f;

/// Parametric coordinates of a direction away from a point or spot lamp (Cycles, map_to_sphere).
Vec2 sphere_uv(const Vec3& d) {
  const float u = d.x == 0.0f && d.y == 0.0f ? 0.0f : 0.5f - std::atan2(d.x, d.y) * (0.5f * k_inv_pi);
  return {u, 1.0f - std::acos(std::clamp(d.z, -1.0f, 1.0f)) * k_inv_pi};
}

float smoothstep(float x) { return x <= 0.0f ? 0.0f : (x >= 1.0f ? 1.0f : x * x * (3.0f - 2.0f * x)); }

}  // namespace

std::string Lamp::validate(const AnalyticLight& light) {
  const auto message = [&](const char* what) { return "Light \"" + light.name + "\": " + what; };
  if (!is_finite(light.energy)) return message("its energy or colour is not finite");
  if (!light.world_from_light.is_finite()) return message("its transform is not finite");
  const auto usable = [](float v) { return v >= 0.0f && std::isfinite(v); };
  switch (light.kind) {
    case LightKind::spot:
      if (!(light.spot_size_rad > 0.0f) || !(light.spot_size_rad <= 2.0f * k_pi))
        return message("its spot size is not an angle");
      // Below 0.04 degrees: no ray's cosine to the axis is larger than that of the cone.
      if (std::cos(0.5f * light.spot_size_rad) == 1.0f)
        return message("its spot size is too small to let light through");
      if (!usable(light.spot_blend)) return message("its spot blend is negative or not finite");
      [[fallthrough]];
    case LightKind::point:
      if (!usable(light.radius_m)) return message("its radius is negative or not finite");
      if (light.kind == LightKind::spot && normalize(light.world_from_light.column(2)) == Vec3(0.0f))
        return message("its transform has no direction (a scale of zero)");
      break;
    case LightKind::sun:
      if (!usable(light.angle_rad) || light.angle_rad > 1.0001f * k_pi)
        return message("its angle is not within 0 and 180 degrees");
      if (normalize(light.world_from_light.column(2)) == Vec3(0.0f))
        return message("its transform has no direction (a scale of zero)");
      break;
    case LightKind::area: {
      if (!usable(light.spread_rad)) return message("its spread is negative or not finite");
      const Vec3 u = light.world_from_light.column(0) * light.size_m.x,
                 v = light.world_from_light.column(1) * light.size_m.y;
      const float area = length(u) * length(v);
      if (!(area > 0.0f) || !std::isfinite(area) || normalize(cross(normalize(u), normalize(v))) == Vec3(0.0f))
        return message("it has no area (a size or scale of zero)");
      break;
    }
    default:
      return message("it is not a lamp");
  }
  return {};
}

Lamp::Lamp(const AnalyticLight& light)
    : kind_(light.kind), center_(light.world_from_light.origin()), traits_(light.traits) {
  const Vec3 shines = -normalize(light.world_from_light.column(2));
  frame_ = Frame::from_normal(length_squared(shines) > 0.0f ? shines : Vec3(0, 0, 1));
  cluster_scale_ = light.traits.program ? std::fabs(luminance(light.program_average)) : 1.0f;
  switch (kind_) {
    case LightKind::spot:
      cos_cone_ = std::cos(0.5f * light.spot_size_rad);
      smooth_ = (1.0f - cos_cone_) * light.spot_blend;
      cos_bound_ = std::max(cos_cone_, 0.0f);
      spot_cosine_ = light.spot_cosine;
      if (!spot_cosine_) {
        const Vec3 x = light.world_from_light.column(0), y = light.world_from_light.column(1);
        const float along = length(light.world_from_light.column(2));
        const auto row = [&](const Vec3& axis) {
          const float scale = length(axis);
          return scale > 0.0f ? axis * (along / (scale * scale)) : Vec3(0.0f);
        };
        spot_rows_[0] = row(x);
        spot_rows_[1] = row(y);
        const float widest = std::max({length(x), length(y), along * 1e-6f}) / along;
        const float tangent = std::sqrt(std::max(1.0f - sqr(cos_bound_), 0.0f)) / cos_bound_ * widest;
        cos_bound_ = widest == 1.0f ? cos_bound_ : 1.0f / std::sqrt(1.0f + tangent * tangent);
      }
      [[fallthrough]];
    case LightKind::point: {
      radius_ = light.radius_m;
      is_delta_ = !(radius_ > 0.0f);
      sphere_ = light.sphere && !is_delta_;
      const float disk_area = is_delta_ ? 1.0f : k_pi * radius_ * radius_;
      const float scale = light.normalize ? 1.0f : (is_delta_ ? 4.0f : 4.0f * disk_area);
      radiance_ = light.energy * (scale * 0.25f * k_inv_pi / disk_area);
      break;
    }
    case LightKind::sun: {
      const float half = 0.5f * light.angle_rad;
      radius_ = std::fabs(std::tan(half));
      is_delta_ = !(radius_ > 0.0f);
      one_minus_cos_ = one_minus_cos_of_angle(half);
      const float scale = light.normalize || is_delta_ ? 1.0f : k_pi * sqr(std::sin(half));
      even_sun_ = light.even_sun && !is_delta_;
      const float area = k_pi * sqr(even_sun_ ? std::sin(half) : radius_);
      radiance_ = light.energy * (is_delta_ ? scale : scale / area);
      break;
    }
    default: {
      const Vec3 edge_u = light.world_from_light.column(0) * light.size_m.x;
      const Vec3 edge_v = light.world_from_light.column(1) * light.size_m.y;
      unit_u_ = normalize(edge_u);
      width_ = length(edge_u);
      // A sheared transform: keep the width, and of the height what is orthogonal to it.
      const Vec3 across = edge_v - unit_u_ * dot(edge_v, unit_u_);
      unit_v_ = normalize(across);
      height_ = length(across);
      Vec3 n = normalize(cross(unit_u_, unit_v_));
      if (dot(n, light.world_from_light.column(2)) > 0.0f) n = -n;
      frame_ = Frame::from_normal_and_tangent(n, unit_u_);
      round_ = light.round;
      area_ = width_ * height_ * (round_ ? 0.25f * k_pi : 1.0f);
      // Normalisation: the integral over theta of cos(theta) (1 - tan(theta) / tan(half)) sin(theta) for theta up to
      // half. A beam of none at all is one of a hundredth of a degree: as wide where it arrives as far as can be seen.
      const double half = 0.5 * static_cast<double>(std::max(light.spread_rad, k_least_spread_rad));
      if (half < 0.5 * std::numbers::pi - 1e-6) {
        const double t = 1.0 / std::tan(half);
        tan_spread_ = static_cast<float>(t);
        spread_norm_ = static_cast<float>(1.0 / (1.0 - half * t));
      }
      radiance_ = light.energy * (light.normalize ? 0.25f / area_ : 0.25f);
      break;
    }
  }
}

float Lamp::spot_attenuation(const Vec3& direction) const {
  if (kind_ != LightKind::spot) return 1.0f;
  float cos_angle = dot(direction, frame_.n);
  if (!spot_cosine_) cos_angle /= length(Vec3(dot(direction, spot_rows_[0]), dot(direction, spot_rows_[1]), cos_angle));
  if (!(cos_angle > std::max(cos_cone_, 0.0f))) return 0.0f;
  const float t = cos_angle - cos_cone_;
  return (t < smooth_ ? smoothstep(t / smooth_) : 1.0f) * (spot_cosine_ ? cos_angle : 1.0f);
}

float Lamp::one_minus_cos_seen_from(float distance) const {
  return sphere_ ? one_minus_cos_of_sine_squared(std::min(sqr(radius_ / distance), 1.0f))
                 : one_minus_cos_of_tangent(radius_, distance);
}

float Lamp::spread_attenuation(const Vec3& direction) const {
  if (tan_spread_ == 0.0f) return 1.0f;
  // The tangent from the part across the normal: 1 - cos² would lose the narrow spreads' digits.
  const float along = dot(direction, frame_.n);
  const float tan_angle = length(direction - frame_.n * along) / std::fabs(along);
  return std::max((1.0f - tan_spread_ * tan_angle) * spread_norm_, 0.0f);
}

LightCluster Lamp::cluster() const {
  LightCluster cluster;
  cluster.center = center_;
  cluster.axis = frame_.n;
  const double on_axis = std::fabs(static_cast<double>(luminance(radiance_))) * static_cast<double>(cluster_scale_);
  if (kind_ == LightKind::area) {
    cluster.radius = 0.5f * (round_ ? std::max(width_, height_) : length(Vec3(width_, height_, 0.0f)));
    cluster.cos_emission = tan_spread_ / std::sqrt(1.0f + tan_spread_ * tan_spread_);
    cluster.intensity = on_axis * static_cast<double>(area_) * static_cast<double>(spread_norm_);
  } else {
    cluster.radius = radius_;
    cluster.cos_normals = kind_ == LightKind::spot ? 1.0f : -1.0f;
    cluster.cos_emission = kind_ == LightKind::spot ? cos_bound_ : 0.0f;
    cluster.intensity =
        on_axis * (is_delta_ ? 1.0 : std::numbers::pi * static_cast<double>(radius_) * static_cast<double>(radius_));
  }
  return cluster;
}

double Lamp::irradiance() const {
  // A wide disk's irradiance on a facing surface: 2 E (sqrt(1 + r²) - 1) / r² (integral of E / (pi r²) cos over the
  // disk).
  const double on_axis = std::fabs(static_cast<double>(luminance(radiance_))) * static_cast<double>(cluster_scale_);
  if (is_delta_) return on_axis;
  // An even disk's: pi L sin².
  if (even_sun_)
    return on_axis * std::numbers::pi * static_cast<double>(one_minus_cos_) *
           (2.0 - static_cast<double>(one_minus_cos_));
  const double r_squared = static_cast<double>(radius_) * static_cast<double>(radius_);
  return on_axis * 2.0 * std::numbers::pi * r_squared / (std::sqrt(1.0 + r_squared) + 1.0);
}

float Lamp::largest_cos(const Vec3& n) const {
  const float cos_axis = std::clamp(-dot(n, frame_.n), -1.0f, 1.0f);
  const float cos_half = 1.0f - one_minus_cos_, sin_half = safe_sqrt(one_minus_cos_ * (2.0f - one_minus_cos_));
  if (cos_axis >= cos_half) return 1.0f;
  // cos(angle to the axis - half angle); a hair more, so that rounding does not lose the rim.
  return std::max(cos_axis * cos_half + safe_sqrt(1.0f - cos_axis * cos_axis) * sin_half + 1e-6f, 0.0f);
}

Bounds3 Lamp::bounds() const {
  Vec3 half(radius_);
  if (kind_ == LightKind::area) half = abs(unit_u_) * (0.5f * width_) + abs(unit_v_) * (0.5f * height_);
  return {center_ - half, center_ + half};
}

/// The part of the rectangle from which spread lets light reach p (Cycles, light_spread_clamp_area_light); without area
/// if none.
Lamp::Part Lamp::lit_part(const Vec3& p) const {
  const Part whole{-0.5f * width_, -0.5f * height_, width_, height_, true};
  if (tan_spread_ == 0.0f) return whole;
  const Vec3 to_p = p - center_;
  const float reach = std::fabs(dot(to_p, frame_.n)) / tan_spread_;
  const float at_u = dot(to_p, unit_u_), at_v = dot(to_p, unit_v_);
  const float low_u = std::max(at_u - reach, -0.5f * width_), high_u = std::min(at_u + reach, 0.5f * width_);
  const float low_v = std::max(at_v - reach, -0.5f * height_), high_v = std::min(at_v + reach, 0.5f * height_);
  if (!(low_u < high_u) || !(low_v < high_v)) return {0.0f, 0.0f, 0.0f, 0.0f, false};
  // An ellipse keeps its own sampling unless the lit rectangle is smaller.
  if (round_ && (high_u - low_u) * (high_v - low_v) > area_) return whole;
  return {low_u, low_v, high_u - low_u, high_v - low_v, false};
}

LampSample Lamp::sample(const Vec3& p, const Vec2& u) const {
  LampSample sample;
  if (kind_ == LightKind::sun) {
    const Vec3 to_sun = -frame_.n;
    sample.distance = k_infinity;
    sample.direction = to_sun;
    sample.n = frame_.n;
    sample.uv = u;
    sample.radiance = radiance_;
    sample.pdf_solid_angle = 1.0f;
    if (is_delta_) return sample;
    if (even_sun_) {
      sample.direction = Frame::from_normal(to_sun).to_world(sample_cone(u, one_minus_cos_));
      sample.n = -sample.direction;
      sample.pdf_solid_angle = pdf_solid_angle_cone(one_minus_cos_);
      return sample;
    }
    const Vec2 d = sample_disk(u) * radius_;
    // cos of the angle off axis is 1 / |(d, 1)|; solid angle is cos³ times area on the disk one metre away.
    const float per_cos = std::sqrt(1.0f + d.x * d.x + d.y * d.y);
    const float per_cos_cubed = per_cos * per_cos * per_cos;
    sample.direction = (to_sun + frame_.s * d.x + frame_.t * d.y) * (1.0f / per_cos);
    sample.n = -sample.direction;
    sample.radiance = radiance_ * per_cos_cubed;
    sample.pdf_solid_angle = per_cos_cubed / (k_pi * radius_ * radius_);
    return sample;
  }
  const Vec3 to_center = center_ - p;
  if (kind_ == LightKind::area) {
    if (!(dot(to_center, frame_.n) < 0.0f)) return sample;
    const Part part = lit_part(p);
    if (!(part.width > 0.0f)) return sample;
    const bool by_ellipse = round_ && part.whole;
    Vec2 in_plane;  // m from the centre
    if (by_ellipse) {
      const Vec2 d = sample_disk(u) * 0.5f;
      in_plane = {width_ * d.x, height_ * d.y};
    } else {
      const SphericalRectangle rectangle(p, corner_of(part), unit_u_, unit_v_, part.width, part.height);
      const Vec2 st = rectangle.sample(u);
      in_plane = {part.u + part.width * st.x, part.v + part.height * st.y};
      sample.pdf_solid_angle = rectangle.pdf_solid_angle(st);
    }
    sample.p = center_ + unit_u_ * in_plane.x + unit_v_ * in_plane.y;
    const float along_u = in_plane.x / width_, along_v = in_plane.y / height_;
    if (round_ && !by_ellipse && along_u * along_u + along_v * along_v > 0.25f) return {};
    const Vec3 to_light = sample.p - p;
    sample.distance = length(to_light);
    sample.direction = to_light * (1.0f / sample.distance);
    sample.n = frame_.n;
    const float cos_light = -dot(sample.direction, frame_.n);
    if (!(cos_light > 0.0f)) return {};
    if (by_ellipse) sample.pdf_solid_angle = sqr(sample.distance) / (cos_light * area_);
    sample.uv = {along_v + 0.5f, -along_u - along_v};
    sample.radiance = radiance_ * spread_attenuation(sample.direction);
    return sample;
  }
  const float d = length(to_center);
  if (!(d > 0.0f)) return sample;
  const Vec3 axis = to_center * (1.0f / d);
  sample.n = -axis;
  if (is_delta_) {
    sample.direction = axis;
    sample.distance = d;
    sample.p = center_;
    // (1 / d) twice: d² may underflow or overflow where intensity / d² does not.
    sample.radiance = radiance_ * spot_attenuation(-axis) * (1.0f / d) * (1.0f / d);
    sample.pdf_solid_angle = 1.0f;
  } else if (holds(d * d)) {
    sample.direction = sample_uniform_sphere(u);
    sample.pdf_solid_angle = k_pdf_solid_angle_uniform_sphere;
    const float along = dot(sample.direction, to_center);
    sample.distance = along + safe_sqrt(sqr(radius_) - length_squared(to_center - sample.direction * along));
    sample.p = p + sample.direction * sample.distance;
    sample.n = -sample.direction;
    sample.radiance = radiance_;
  } else {
    const float one_minus_cos = one_minus_cos_seen_from(d);
    const Vec3 local = sample_cone(u, one_minus_cos);
    if (!(local.z > 0.0f)) return {};
    sample.direction = Frame::from_normal(axis).to_world(local);
    sample.distance =
        sphere_ ? d * local.z - safe_sqrt(sqr(radius_) - sqr(d) * (sqr(local.x) + sqr(local.y))) : d / local.z;
    sample.p = p + sample.direction * sample.distance;
    if (sphere_) sample.n = normalize(sample.p - center_);
    sample.radiance = radiance_ * spot_attenuation(-sample.direction);
    sample.pdf_solid_angle = pdf_solid_angle_cone(one_minus_cos);
  }
  if (traits_.program) sample.uv = sphere_uv(sphere_ ? sample.n : -sample.direction);
  return sample;
}

float Lamp::pdf_solid_angle(const Vec3& p, const Vec3& direction, float distance) const {
  if (is_delta_) return 0.0f;
  if (kind_ == LightKind::sun) {
    const float cos_angle = -dot(direction, frame_.n);
    if (even_sun_) return pdf_solid_angle_cone(one_minus_cos_);
    return cos_angle > 0.0f ? 1.0f / (k_pi * radius_ * radius_ * cos_angle * cos_angle * cos_angle) : 0.0f;
  }
  if (kind_ != LightKind::area) {
    const float d = length(center_ - p);
    if (holds(d * d)) return k_pdf_solid_angle_uniform_sphere;
    return d > 0.0f ? pdf_solid_angle_cone(one_minus_cos_seen_from(d)) : 0.0f;
  }
  if (!(dot(center_ - p, frame_.n) < 0.0f)) return 0.0f;
  const Part part = lit_part(p);
  if (!(part.width > 0.0f)) return 0.0f;
  const float cos_light = -dot(direction, frame_.n);
  if (!(cos_light > 0.0f)) return 0.0f;
  if (round_ && part.whole) return sqr(distance) / (cos_light * area_);
  const Vec3 corner = corner_of(part), from_corner = p + direction * distance - corner;
  const Vec2 st(dot(from_corner, unit_u_) / part.width, dot(from_corner, unit_v_) / part.height);
  if (!(st.x >= -1e-4f && st.x <= 1.0001f && st.y >= -1e-4f && st.y <= 1.0001f)) return 0.0f;
  return SphericalRectangle(p, corner, unit_u_, unit_v_, part.width, part.height).pdf_solid_angle(st);
}

bool Lamp::intersect(const Vec3& origin, const Vec3& direction, float t_min, float t_max, LightHit& hit) const {
  if (is_delta_ || kind_ == LightKind::sun) return false;
  const Vec3 to_center = center_ - origin;
  hit.direction_world = direction;
  if (kind_ == LightKind::area) {
    const float cos_light = -dot(direction, frame_.n);
    if (!(cos_light > 0.0f)) return false;
    hit.distance_m = -dot(to_center, frame_.n) / cos_light;
    if (!(hit.distance_m > t_min && hit.distance_m < t_max)) return false;
    const Vec3 in_plane = direction * hit.distance_m - to_center;
    const float along_u = dot(in_plane, unit_u_) / width_, along_v = dot(in_plane, unit_v_) / height_;
    if (round_ ? along_u * along_u + along_v * along_v > 0.25f
               : std::max(std::fabs(along_u), std::fabs(along_v)) > 0.5f)
      return false;
    hit.uv = {along_v + 0.5f, -along_u - along_v};
    hit.n_light_world = frame_.n;
    hit.radiance = radiance_ * spread_attenuation(direction);
  } else if (sphere_) {
    const float along = dot(to_center, direction);
    const float half_squared = sqr(radius_) - length_squared(to_center - direction * along);
    if (!(half_squared >= 0.0f)) return false;
    const bool within = holds(length_squared(to_center));
    hit.distance_m = along + (within ? std::sqrt(half_squared) : -std::sqrt(half_squared));
    if (!(hit.distance_m > t_min && hit.distance_m < t_max)) return false;
    hit.n_light_world = normalize(direction * hit.distance_m - to_center);
    if (traits_.program) hit.uv = sphere_uv(hit.n_light_world);
    hit.radiance = within ? radiance_ : radiance_ * spot_attenuation(-direction);
  } else {
    const float d = length(to_center);
    const float cos_angle = dot(direction, to_center) / d;
    if (!(cos_angle > 0.0f)) return false;
    hit.distance_m = d / cos_angle;
    if (!(hit.distance_m > t_min && hit.distance_m < t_max)) return false;
    // Distance from the centre on the facing disk.
    if (length_squared(direction * hit.distance_m - to_center) > radius_ * radius_) return false;
    hit.n_light_world = to_center * (-1.0f / d);
    if (traits_.program) hit.uv = sphere_uv(-direction);
    hit.radiance = radiance_ * spot_attenuation(-direction);
  }
  hit.p_light_world = origin + direction * hit.distance_m;
  return !is_black(hit.radiance);
}

bool Lamp::intersect_infinite(const Vec3& direction, LightHit& hit) const {
  if (is_delta_ || kind_ != LightKind::sun) return false;
  // 1 - cos by half the squared chord: precise for disks as small as the real sun's.
  const Vec3 chord = direction + frame_.n;
  if (0.5f * length_squared(chord) > one_minus_cos_) return false;
  const float cos_angle = -dot(direction, frame_.n);
  if (!(cos_angle > 0.0f)) return false;
  hit.distance_m = k_infinity;
  hit.direction_world = direction;
  hit.n_light_world = -direction;
  hit.radiance = even_sun_ ? radiance_ : radiance_ * (1.0f / (cos_angle * cos_angle * cos_angle));
  return true;
}

Vec3 start_of_infinite_ray(const Vec3& direction, const Vec2& u, const EmissionTarget* target, const Vec3& scene_center,
                           float scene_radius) {
  const Vec3 p = (target ? *target : EmissionTarget{scene_center, scene_radius}).sample_line(direction, u);
  return p - direction * (scene_radius + dot(p - scene_center, direction));
}

bool Lamp::sample_emission(const Vec2& u_position, const Vec2& u_direction, const Vec3& scene_center,
                           float scene_radius, const EmissionTarget* target, EmissionSample& sample) const {
  sample.is_delta_position = is_delta_ && kind_ != LightKind::sun;
  sample.is_delta_direction = is_delta_ && kind_ == LightKind::sun;
  sample.is_infinite = kind_ == LightKind::sun;
  sample.cos_light = 1.0f;
  if (kind_ == LightKind::sun) {
    const LampSample towards = this->sample(Vec3(0.0f), u_direction);
    sample.direction_world = -towards.direction;
    sample.n_light_world = -towards.direction;
    sample.p_light_world = start_of_infinite_ray(-towards.direction, u_position, target, scene_center, scene_radius);
    sample.radiance = towards.radiance;
    return true;
  }
  sample.p_light_world = center_;
  if (kind_ == LightKind::area) {
    const Vec2 d = round_ ? sample_disk(u_position) * 0.5f : Vec2(u_position.x - 0.5f, u_position.y - 0.5f);
    sample.p_light_world = center_ + unit_u_ * (width_ * d.x) + unit_v_ * (height_ * d.y);
    sample.uv = {d.y + 0.5f, -d.x - d.y};
  }
  // Directions: the target's cone; else the sphere for points; by the cosine within the cone that emits for the others.
  if (target) {
    sample.direction_world = target->sample_direction(sample.p_light_world, u_direction);
  } else if (kind_ == LightKind::point) {
    sample.direction_world = sample_uniform_sphere(u_direction);
  } else if (kind_ == LightKind::spot && !spot_cosine_) {
    sample.direction_world = frame_.to_world(sample_cone(u_direction, 1.0f - cos_bound_));
  } else {
    const float sin_squared =
        kind_ == LightKind::spot ? 1.0f - sqr(cos_bound_) : 1.0f / (1.0f + tan_spread_ * tan_spread_);
    const Vec2 d = sample_disk(u_direction) * std::sqrt(sin_squared);
    sample.direction_world = frame_.to_world({d.x, d.y, safe_sqrt(1.0f - d.x * d.x - d.y * d.y)});
  }
  const Vec3& w = sample.direction_world;
  const float cos_axis = dot(w, frame_.n);
  if (kind_ == LightKind::area) {
    sample.n_light_world = frame_.n;
    sample.cos_light = cos_axis;
    sample.radiance = radiance_ * spread_attenuation(w);
    return cos_axis > 0.0f;
  }
  sample.n_light_world = w;
  if (traits_.program) sample.uv = sphere_uv(w);
  sample.radiance = radiance_ * spot_attenuation(w);
  if (is_delta_) return true;
  const Vec2 d = sample_disk(u_position);
  const float b_squared = d.x * d.x + d.y * d.y;
  if (!(b_squared < 1.0f)) return false;
  const Frame frame = Frame::from_normal(w);
  const float along = sphere_ ? std::sqrt(1.0f - b_squared) : b_squared / std::sqrt(1.0f - b_squared);
  const Vec3 from_center = frame.s * d.x + frame.t * d.y + w * along;
  sample.p_light_world = center_ + from_center * radius_;
  if (!sphere_) {
    sample.b_squared_m2 = b_squared * radius_ * radius_;
    sample.along_m = along * radius_;
  }
  if (sphere_ && traits_.program) sample.uv = sphere_uv(from_center);
  return true;
}

EmissionPdf Lamp::pdf_emission(const Vec3& direction_from_light, float scene_radius) const {
  EmissionPdf pdf;
  const float cos_axis = dot(direction_from_light, frame_.n);
  switch (kind_) {
    case LightKind::sun:
      pdf.pdf_area = 1.0f / (k_pi * scene_radius * scene_radius);
      pdf.pdf_direction_solid_angle = is_delta_ ? 1.0f : pdf_solid_angle(Vec3(0.0f), -direction_from_light, k_infinity);
      return pdf;
    case LightKind::point:
      pdf.pdf_direction_solid_angle = k_pdf_solid_angle_uniform_sphere;
      break;
    case LightKind::spot: {
      if (cos_axis > cos_bound_)
        pdf.pdf_direction_solid_angle = spot_cosine_ ? cos_axis * k_inv_pi / (1.0f - cos_bound_ * cos_bound_)
                                                     : pdf_solid_angle_cone(1.0f - cos_bound_);
      break;
    }
    default:
      if (cos_axis > 0.0f && 1.0f - cos_axis * cos_axis <= 1.0f / (1.0f + tan_spread_ * tan_spread_) + 1e-6f)
        pdf.pdf_direction_solid_angle = cos_axis * k_inv_pi * (1.0f + tan_spread_ * tan_spread_);
      pdf.pdf_area = 1.0f / area_;
      return pdf;
  }
  pdf.pdf_area = is_delta_ ? 1.0f : 1.0f / (k_pi * radius_ * radius_);
  return pdf;
}

}  // namespace lambent
