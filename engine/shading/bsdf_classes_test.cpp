#include <gtest/gtest.h>

#include "engine/base/frame.h"
#include "engine/shading/bsdf_set.h"
#include "engine/shading/lobe.h"
#include "engine/shading/shading_point.h"

namespace lambent {
namespace {

Bsdf of_one(LobeKind kind, const Vec3& n, const Vec3& wi_world) {
  ShadingPoint point;
  point.ng_world = point.ns_world = Vec3(0, 0, 1);
  point.wi_world = wi_world;
  Bsdf bsdf;
  bsdf.begin(point);
  Lobe lobe;
  lobe.kind = kind;
  lobe.n = n;
  lobe.alpha_x = lobe.alpha_y = 0.3f;
  lobe.eta = 1.5f;
  bsdf.add(lobe);
  return bsdf;
}

// Seen from a light, an interpolated normal may have the camera behind it though the surface has not.
TEST(BsdfClasses, what_only_reflects_transmits_nothing_whichever_side_of_its_normal_directions_are_on) {
  const Vec3 n = normalize(Vec3(0.8f, 0, 0.6f)), light = n, camera = normalize(Vec3(-1, 0, 0.3f));
  ASSERT_LT(dot(n, camera), 0.0f);
  for (const LobeKind kind : {LobeKind::reflection, LobeKind::diffuse, LobeKind::sheen, LobeKind::glossy_toon}) {
    const Bsdf bsdf = of_one(kind, n, light);
    const auto only_class = bsdf.only_class(light, camera);
    ASSERT_TRUE(only_class);
    EXPECT_NE(*only_class, LobeClass::transmission) << static_cast<int>(kind);
    EXPECT_EQ(*bsdf.only_event(light, camera) & k_scatter_transmission, 0) << static_cast<int>(kind);
    EXPECT_EQ(bsdf.event_shares(light, camera).transmission, 0.0f);
    EXPECT_EQ(bsdf.class_shares(light, camera, Transport::importance).of[2], Color(0.0f));
  }
}

TEST(BsdfClasses, what_transmits_alone_does_and_glass_by_the_side) {
  const Vec3 n(0, 0, 1), above = normalize(Vec3(0.5f, 0, 1)), below = normalize(Vec3(0.2f, 0, -1));
  for (const Vec3& to : {above, below}) {
    EXPECT_EQ(of_one(LobeKind::refraction, n, above).only_class(above, to), LobeClass::transmission);
    EXPECT_EQ(of_one(LobeKind::translucent, n, above).only_class(above, to), LobeClass::diffuse);
    EXPECT_EQ(of_one(LobeKind::glass, n, above).only_class(above, to),
              to.z > 0.0f ? LobeClass::glossy : LobeClass::transmission);
  }
}

}  // namespace
}  // namespace lambent
