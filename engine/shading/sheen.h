// Sheen of a layer of fibres with all orders of scattering, as a linearly transformed cosine that leans with the view:
// Zeltner, Burley & Chiang 2022, "Practical Multiple-Scattering Sheen Using Linearly Transformed Cosines", with Hill's
// fits to their tables (as in MaterialX 1.39). What Cycles has since 4.0, whose tables it meets within about 2%.
#pragma once

#include "engine/base/vec.h"
#include "engine/sampling/warp.h"

namespace lambent {

struct SheenFit {
  float a, b;    ///< the transform's inverse: (x, y, z) → (a·x + b·z, a·y, z), x towards the view
  float albedo;  ///< of the layer, seen from the view

  /// @param cos_view in [0, 1] @param roughness in [0, 1]
  SheenFit(float cos_view, float roughness) {
    const float x = std::clamp(cos_view, 0.0f, 1.0f), y = std::clamp(roughness, 0.01f, 1.0f);
    a = std::max((2.58126f * x + 0.813703f * y) * y / (1.0f + 0.310327f * x * x + 2.60994f * x * y), 1e-5f);
    b = safe_sqrt(1.0f - x) * (y - 1.0f) * y * y * y /
        (2.54053e-5f + 1.71228f * x - 1.71506f * x * y + 1.34174f * y * y);
    const float s = y * (0.0206607f + 1.58491f * y) / (0.0379424f + y * (1.32227f + y));
    const float m = y * (-0.193854f + y * (-1.14885f + y * (1.7932f - 0.95943f * y * y))) / (0.046391f + y);
    const float o = y * (0.000654023f + (-0.0207818f + 0.119681f * y) * y) / (1.26264f + y * (-1.92021f + y));
    constexpr float k_sqrt_two_pi = 2.50662827f;
    albedo = std::clamp(std::exp(-0.5f * sqr((x - m) / s)) / (s * k_sqrt_two_pi) + o, 0.0f, 1.0f);
  }

  /// Per solid angle of the light, for unit directions in a frame with the normal as z; integrates to 1.
  float density(const Vec3& view, const Vec3& light) const {
    const Vec3 l = turned(view, light, 1.0f);
    const float length2 = sqr(a * l.x + b * l.z) + sqr(a * l.y) + sqr(l.z);
    return l.z > 0.0f ? k_inv_pi * l.z * sqr(a / length2) : 0.0f;
  }

  /// A direction with that density.
  Vec3 sample(const Vec3& view, const Vec2& u) const {
    const Vec3 c = sample_cosine_hemisphere(u);
    return turned(view, normalize(Vec3(c.x - c.z * b, c.y, c.z * a)), -1.0f);
  }

 private:
  // Around z, so that the view's direction becomes x (sense 1), or back (−1).
  static Vec3 turned(const Vec3& view, const Vec3& v, float sense) {
    const float sine2 = view.x * view.x + view.y * view.y;
    if (!(sine2 > 1e-14f)) return v;
    const float scale = 1.0f / std::sqrt(sine2), c = view.x * scale, s = sense * view.y * scale;
    return {c * v.x + s * v.y, c * v.y - s * v.x, v.z};
  }
};

}  // namespace lambent
