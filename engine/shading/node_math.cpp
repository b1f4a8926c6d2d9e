#include "engine/shading/node_math.h"

namespace lambent {
namespace {

float wrap(float x, float high, float low) {
  const float range = high - low;
  return range != 0.0f ? x - range * std::floor((x - low) / range) : low;
}
float smooth_minimum(float a, float b, float k) {
  if (k == 0.0f) return std::min(a, b);
  const float h = std::max(k - std::fabs(a - b), 0.0f) / k;
  return std::min(a, b) - h * h * h * k * (1.0f / 6.0f);
}
float modulo(float a, float b) { return b != 0.0f ? std::fmod(a, b) : 0.0f; }
float power(float a, float b) { return a < 0.0f && b != std::trunc(b) ? 0.0f : std::pow(a, b); }
float sign(float x) { return x > 0.0f ? 1.0f : x < 0.0f ? -1.0f : 0.0f; }

template <typename F>
Vec3 each(const Vec3& a, const F& f) {
  return {f(a.x), f(a.y), f(a.z)};
}
template <typename F>
Vec3 each(const Vec3& a, const Vec3& b, const F& f) {
  return {f(a.x, b.x), f(a.y, b.y), f(a.z, b.z)};
}

}  // namespace

float math_operation(MathOperation operation, float a, float b, float c) {
  switch (operation) {
    case MathOperation::add:
      return a + b;
    case MathOperation::subtract:
      return a - b;
    case MathOperation::multiply:
      return a * b;
    case MathOperation::divide:
      return safe_divide(a, b);
    case MathOperation::multiply_add:
      return a * b + c;
    case MathOperation::power:
      return power(a, b);
    case MathOperation::logarithm:
      return a > 0.0f && b > 0.0f ? safe_divide(std::log(a), std::log(b)) : 0.0f;
    case MathOperation::sqrt:
      return safe_sqrt(a);
    case MathOperation::inverse_sqrt:
      return a > 0.0f ? 1.0f / std::sqrt(a) : 0.0f;
    case MathOperation::absolute:
      return std::fabs(a);
    case MathOperation::exponent:
      return std::exp(a);
    case MathOperation::minimum:
      return std::min(a, b);
    case MathOperation::maximum:
      return std::max(a, b);
    case MathOperation::less_than:
      return a < b ? 1.0f : 0.0f;
    case MathOperation::greater_than:
      return a > b ? 1.0f : 0.0f;
    case MathOperation::sign:
      return sign(a);
    case MathOperation::compare:
      return a == b || std::fabs(a - b) <= std::max(c, std::numeric_limits<float>::epsilon()) ? 1.0f : 0.0f;
    case MathOperation::smooth_min:
      return smooth_minimum(a, b, c);
    case MathOperation::smooth_max:
      return -smooth_minimum(-a, -b, c);
    case MathOperation::round:
      return std::floor(a + 0.5f);
    case MathOperation::floor:
      return std::floor(a);
    case MathOperation::ceil:
      return std::ceil(a);
    case MathOperation::truncate:
      return std::trunc(a);
    case MathOperation::fraction:
      return fraction(a);
    case MathOperation::modulo:
      return modulo(a, b);
    case MathOperation::floored_modulo:
      return b != 0.0f ? a - std::floor(a / b) * b : 0.0f;
    case MathOperation::wrap:
      return wrap(a, b, c);
    case MathOperation::snap:
      return std::floor(safe_divide(a, b)) * b;
    case MathOperation::pingpong:
      return b != 0.0f ? std::fabs(fraction((a - b) / (b * 2.0f)) * b * 2.0f - b) : 0.0f;
    case MathOperation::sine:
      return std::sin(a);
    case MathOperation::cosine:
      return std::cos(a);
    case MathOperation::tangent:
      return std::tan(a);
    case MathOperation::arcsine:
      return std::asin(std::clamp(a, -1.0f, 1.0f));
    case MathOperation::arccosine:
      return std::acos(std::clamp(a, -1.0f, 1.0f));
    case MathOperation::arctangent:
      return std::atan(a);
    case MathOperation::arctan2:
      return std::atan2(a, b);
    case MathOperation::sinh:
      return std::sinh(a);
    case MathOperation::cosh:
      return std::cosh(a);
    case MathOperation::tanh:
      return std::tanh(a);
    case MathOperation::radians:
      return a * (k_pi / 180.0f);
    case MathOperation::degrees:
      return a * (180.0f / k_pi);
  }
  return 0.0f;
}

Vec3 vector_operation(VectorOperation operation, const Vec3& a, const Vec3& b, const Vec3& c, float scale) {
  switch (operation) {
    case VectorOperation::add:
      return a + b;
    case VectorOperation::subtract:
      return a - b;
    case VectorOperation::multiply:
      return a * b;
    case VectorOperation::divide:
      return each(a, b, safe_divide);
    case VectorOperation::multiply_add:
      return a * b + c;
    case VectorOperation::cross:
      return cross(a, b);
    case VectorOperation::project: {
      const float squared = dot(b, b);
      return squared != 0.0f ? b * (dot(a, b) / squared) : Vec3(0.0f);
    }
    case VectorOperation::reflect: {
      const Vec3 n = normalize(b);
      return a - n * (2.0f * dot(a, n));
    }
    case VectorOperation::refract: {
      const Vec3 n = normalize(b);
      const float cosine = dot(n, a);
      const float k = 1.0f - scale * scale * (1.0f - cosine * cosine);
      return k < 0.0f ? Vec3(0.0f) : a * scale - n * (scale * cosine + std::sqrt(k));
    }
    case VectorOperation::faceforward:
      return dot(c, b) < 0.0f ? a : a * -1.0f;
    case VectorOperation::scale:
      return a * scale;
    case VectorOperation::normalize:
      return normalize(a);
    case VectorOperation::absolute:
      return abs(a);
    case VectorOperation::power:
      return each(a, b, power);
    case VectorOperation::sign:
      return each(a, sign);
    case VectorOperation::minimum:
      return each(a, b, [](float x, float y) { return std::min(x, y); });
    case VectorOperation::maximum:
      return each(a, b, [](float x, float y) { return std::max(x, y); });
    case VectorOperation::floor:
      return each(a, [](float x) { return std::floor(x); });
    case VectorOperation::ceil:
      return each(a, [](float x) { return std::ceil(x); });
    case VectorOperation::fraction:
      return each(a, fraction);
    case VectorOperation::modulo:
      return each(a, b, modulo);
    case VectorOperation::wrap:
      return {wrap(a.x, b.x, c.x), wrap(a.y, b.y, c.y), wrap(a.z, b.z, c.z)};
    case VectorOperation::snap:
      return each(a, b, [](float x, float y) { return std::floor(safe_divide(x, y)) * y; });
    case VectorOperation::sine:
      return each(a, [](float x) { return std::sin(x); });
    case VectorOperation::cosine:
      return each(a, [](float x) { return std::cos(x); });
    case VectorOperation::tangent:
      return each(a, [](float x) { return std::tan(x); });
    case VectorOperation::round:
      return each(a, [](float x) { return std::floor(x + 0.5f); });
    case VectorOperation::dot:
    case VectorOperation::distance:
    case VectorOperation::length:
      break;
  }
  return Vec3(0.0f);
}

float vector_operation_float(VectorOperation operation, const Vec3& a, const Vec3& b) {
  switch (operation) {
    case VectorOperation::dot:
      return dot(a, b);
    case VectorOperation::distance:
      return length(a - b);
    case VectorOperation::length:
      return length(a);
    default:
      return 0.0f;
  }
}

Vec3 rotate_around_axis(const Vec3& v, const Vec3& axis, float angle_rad) {
  const float c = std::cos(angle_rad), s = std::sin(angle_rad);
  return v * c + cross(axis, v) * s + axis * (dot(axis, v) * (1.0f - c));  // Rodrigues
}

void euler_rows(const Vec3& e, Vec3 rows[3]) {
  const float cx = std::cos(e.x), cy = std::cos(e.y), cz = std::cos(e.z);
  const float sx = std::sin(e.x), sy = std::sin(e.y), sz = std::sin(e.z);
  rows[0] = {cy * cz, sy * sx * cz - cx * sz, sy * cx * cz + sx * sz};
  rows[1] = {cy * sz, sy * sx * sz + cx * cz, sy * cx * sz - sx * cz};
  rows[2] = {-sy, cy * sx, cy * cx};
}

}  // namespace lambent
