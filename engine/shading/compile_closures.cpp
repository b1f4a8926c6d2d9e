// Definitions of the nodes with shader outputs.
#include <map>

#include "engine/shading/compiler.h"

namespace lambent {
namespace {

// Collects a closure's parameters in their order.
class Parameters {
 public:
  Parameters(Compiler& compiler, int node) : compiler_(compiler), node_(node) {}

  Parameters& number(const char* socket, float otherwise) {
    values_.push_back(compiler_.number(node_, socket, otherwise, 0));
    return *this;
  }
  Parameters& constant(float x) {
    values_.push_back(compiler_.expressions().number(x));
    return *this;
  }
  /// A thin film's thickness and index.
  Parameters& film() { return number("Thin Film Thickness", 0.0f).number("Thin Film IOR", 1.33f); }
  Parameters& color(const char* socket, const Color& otherwise) {
    return value(compiler_.color(node_, socket, otherwise, 0));
  }
  Parameters& value(const Value& v) {
    for (int k = 0; k < 3; ++k) values_.push_back(compiler_.expressions().part(v, k, 1));
    return *this;
  }
  const std::vector<Value>& values() const { return values_; }

 private:
  Compiler& compiler_;
  int node_;
  std::vector<Value> values_;
};

GlossModel gloss_model(Compiler& compiler, int node, const char* otherwise) {
  const std::string name = compiler.text(node, "distribution", otherwise);
  if (name == "SHARP") return GlossModel::sharp;
  if (name == "BECKMANN") return GlossModel::beckmann;
  if (name == "GGX") return GlossModel::ggx;
  if (name == "MULTI_GGX") return GlossModel::multiscatter_ggx;
  if (name == "ASHIKHMIN_SHIRLEY") return GlossModel::ashikhmin_shirley;
  compiler.warn_unsupported(node, "its distribution '" + name + "' is rendered as GGX");
  return GlossModel::ggx;
}

// Emission: colour times strength, folded where constant.
void add_emission(Compiler& compiler, int node, const Value& color, const Value& strength, const Value& weight) {
  const Value radiance = compiler.expressions().operation(Op::scale_color, 0, {color, strength}, 3);
  ClosureUse use{};
  use.kind = ClosureKind::emission;
  compiler.add_closure(use, weight, {}, Parameters(compiler, node).value(radiance).values());
}

void add_transparent(Compiler& compiler, int node, const Value& color, const Value& weight) {
  ClosureUse use{};
  use.kind = ClosureKind::transparent;
  compiler.add_closure(use, weight, {}, Parameters(compiler, node).value(color).values());
}

// The node's normals as operands, in the order that add_closure wants.
struct Normals {
  std::vector<Value> values;
  void add(Compiler& compiler, int node, ClosureUse& use, const char* socket) {
    const Value n = compiler.vector_or(node, socket, 0, &Compiler::normal);
    // The plain interpolated normal needs no operand
    if (compiler.is_linked(node, socket) || compiler.has_bumped_normal()) {
      values.push_back(n);
      use.has_normal = true;
    }
  }
  void add_coat(Compiler& compiler, int node, ClosureUse& use, const char* socket) {
    const Value n = compiler.vector_or(node, socket, 0, &Compiler::normal);
    if (compiler.is_linked(node, socket) || compiler.has_bumped_normal()) {
      values.push_back(n);
      use.has_coat_normal = true;
    }
  }
  void add_tangent(Compiler& compiler, int node, ClosureUse& use, const char* amount) {
    if (!compiler.is_linked(node, amount) &&
        compiler.expressions().is_number(compiler.number(node, amount, 0.0f, 0), 0.0f))
      return;
    values.push_back(compiler.vector_or(node, "Tangent", 0, &Compiler::tangent));
    use.has_tangent = true;
  }
};

bool may_be_nonzero(Compiler& compiler, int node, const char* socket, float otherwise) {
  return !compiler.expressions().is_number(compiler.number(node, socket, otherwise, 0), 0.0f);
}

SubsurfaceRules subsurface_rules(Compiler& compiler, int node, const char* property, int generation) {
  const std::string name = compiler.text(node, property, "RANDOM_WALK");
  const bool older = generation == 1;  // their paths see a diffuse surface after any other one
  const bool unscaled = compiler.follows(502);
  if (name == "RANDOM_WALK")
    return {older      ? SubsurfaceMethod::random_walk
            : unscaled ? SubsurfaceMethod::van_de_hulst
                       : SubsurfaceMethod::refractive,
            older};
  if (name == "RANDOM_WALK_LEGACY") return {SubsurfaceMethod::refractive, older};
  if (name == "RANDOM_WALK_SKIN") return {SubsurfaceMethod::skin, older};
  if (name == "BURLEY") return {SubsurfaceMethod::burley, true};
  if (name != "RANDOM_WALK_FIXED_RADIUS")
    compiler.warn_unsupported(node, "its subsurface method '" + name + "' is rendered by a random walk");
  return {SubsurfaceMethod::fixed_radius, older};
}

void principled_1(Compiler& compiler, int node, const Value& weight) {
  Expressions& e = compiler.expressions();
  const Value alpha = compiler.number(node, "Alpha", 1.0f, 0);
  add_transparent(compiler, node, e.vector(Vec3(1.0f)), e.operation(Op::mix_weight_first, 0, {weight, alpha}, 1));
  const Value opaque = e.operation(Op::mix_weight_second, 0, {weight, alpha}, 1);
  add_emission(compiler, node, compiler.color(node, "Emission", Color(0.0f), 0),
               compiler.number(node, "Emission Strength", 1.0f, 0), opaque);
  ClosureUse use{};
  use.kind = ClosureKind::principled_1;
  use.model = gloss_model(compiler, node, "GGX");
  Normals normals;
  normals.add(compiler, node, use, "Normal");
  if (may_be_nonzero(compiler, node, "Clearcoat", 0.0f)) normals.add_coat(compiler, node, use, "Clearcoat Normal");
  normals.add_tangent(compiler, node, use, "Anisotropic");
  Parameters p(compiler, node);
  p.color("Base Color", Color(0.8f)).number("Subsurface", 0.0f).color("Subsurface Color", Color(0.8f));
  p.number("Metallic", 0.0f).number("Specular", 0.5f).number("Specular Tint", 0.0f).number("Roughness", 0.5f);
  p.number("Anisotropic", 0.0f).number("Anisotropic Rotation", 0.0f).number("Sheen", 0.0f).number("Sheen Tint", 0.5f);
  p.number("Clearcoat", 0.0f).number("Clearcoat Roughness", 0.03f).number("IOR", 1.45f);
  p.number("Transmission", 0.0f).number("Transmission Roughness", 0.0f);
  p.color("Subsurface Radius", Color(1.0f, 0.2f, 0.1f)).number("Subsurface IOR", 1.4f);
  p.number("Subsurface Anisotropy", 0.0f).constant(subsurface_rules(compiler, node, "subsurface_method", 1).pack());
  compiler.add_closure(use, opaque, normals.values, p.values());
}

void principled_2(Compiler& compiler, int node, const Value& weight) {
  Expressions& e = compiler.expressions();
  const Value alpha = compiler.number(node, "Alpha", 1.0f, 0);
  add_transparent(compiler, node, e.vector(Vec3(1.0f)), e.operation(Op::mix_weight_first, 0, {weight, alpha}, 1));
  const Value opaque = e.operation(Op::mix_weight_second, 0, {weight, alpha}, 1);
  ClosureUse use{};
  use.kind = ClosureKind::principled_2;
  use.raw_diffuse_normal = true;
  use.model = gloss_model(compiler, node, "MULTI_GGX");
  Normals normals;
  normals.add(compiler, node, use, "Normal");
  if (may_be_nonzero(compiler, node, "Coat Weight", 0.0f)) normals.add_coat(compiler, node, use, "Coat Normal");
  normals.add_tangent(compiler, node, use, "Anisotropic");
  const Value emission = e.operation(
      Op::scale_color, 0,
      {compiler.color(node, "Emission Color", Color(1.0f), 0), compiler.number(node, "Emission Strength", 0.0f, 0)}, 3);
  Parameters p(compiler, node);
  p.color("Base Color", Color(0.8f)).number("Metallic", 0.0f).number("Roughness", 0.5f).number("IOR", 1.5f);
  p.number("Diffuse Roughness", 0.0f).number("Subsurface Weight", 0.0f).number("Specular IOR Level", 0.5f);
  p.color("Specular Tint", Color(1.0f)).number("Anisotropic", 0.0f).number("Anisotropic Rotation", 0.0f);
  p.number("Transmission Weight", 0.0f).number("Coat Weight", 0.0f).number("Coat Roughness", 0.03f);
  p.number("Coat IOR", 1.5f).color("Coat Tint", Color(1.0f)).number("Sheen Weight", 0.0f);
  p.number("Sheen Roughness", 0.5f).color("Sheen Tint", Color(1.0f));
  p.color("Subsurface Radius", Color(1.0f, 0.2f, 0.1f)).number("Subsurface Scale", 0.05f);
  p.number("Subsurface IOR", 1.4f).number("Subsurface Anisotropy", 0.0f);
  p.constant(subsurface_rules(compiler, node, "subsurface_method", 2).pack()).film();
  p.number("Thin Wall", 0.0f).value(emission);
  // A smooth pane lets light straight through.
  use.may_be_transparent =
      may_be_nonzero(compiler, node, "Thin Wall", 0.0f) && may_be_nonzero(compiler, node, "Transmission Weight", 0.0f);
  compiler.add_closure(use, opaque, normals.values, p.values());
}

void principled(Compiler& compiler, int node, const Value& weight) {
  const bool newer =
      compiler.property(node, "generation", 0.0f) == 2.0f ||
      (compiler.property(node, "generation", 0.0f) == 0.0f && compiler.has_input(node, "Specular IOR Level"));
  (newer ? principled_2 : principled_1)(compiler, node, weight);
}

void simple(Compiler& compiler, int node, const Value& weight, ClosureKind kind, const Parameters& parameters,
            GlossModel model = GlossModel::ggx) {
  ClosureUse use{};
  use.kind = kind;
  use.model = model;
  use.raw_diffuse_normal = compiler.follows(400);
  Normals normals;
  if (kind != ClosureKind::transparent) normals.add(compiler, node, use, "Normal");
  compiler.add_closure(use, weight, normals.values, parameters.values());
}

void glossy(Compiler& compiler, int node, const Value& weight) {
  ClosureUse use{};
  use.kind = ClosureKind::glossy;
  use.model = gloss_model(compiler, node, "GGX");
  Normals normals;
  normals.add(compiler, node, use, "Normal");
  normals.add_tangent(compiler, node, use, "Anisotropy");
  Parameters p(compiler, node);
  p.color("Color", Color(0.8f)).number("Roughness", 0.5f).number("Anisotropy", 0.0f).number("Rotation", 0.0f);
  compiler.add_closure(use, weight, normals.values, p.values());
}

void metallic(Compiler& compiler, int node, const Value& weight) {
  const bool physical = compiler.text(node, "fresnel_type", "F82") == "PHYSICAL_CONDUCTOR";
  ClosureUse use{};
  use.kind = physical ? ClosureKind::conductor : ClosureKind::metallic;
  use.model = gloss_model(compiler, node, "MULTI_GGX");
  Normals normals;
  normals.add(compiler, node, use, "Normal");
  normals.add_tangent(compiler, node, use, "Anisotropy");
  Parameters p(compiler, node);
  if (physical)
    p.color("IOR", Color(2.757f, 2.513f, 2.231f));
  else
    p.color("Base Color", Color(0.617f, 0.577f, 0.540f));
  p.number("Roughness", 0.5f).number("Anisotropy", 0.0f).number("Rotation", 0.0f);
  if (physical)
    p.color("Extinction", Color(3.867f, 3.404f, 3.009f));
  else
    p.color("Edge Tint", Color(0.695f, 0.726f, 0.770f));
  p.film();
  compiler.add_closure(use, weight, normals.values, p.values());
}

void subsurface(Compiler& c, int n, const Value& w) {
  const int generation = c.has_input(n, "Roughness") ? 2 : 1;  // before 4.0 it has none
  const Value radius = c.expressions().operation(
      Op::scale_color, 0, {c.color(n, "Radius", Color(1.0f, 0.2f, 0.1f), 0), c.number(n, "Scale", 1.0f, 0)}, 3);
  simple(c, n, w, ClosureKind::subsurface,
         Parameters(c, n)
             .color("Color", Color(0.8f))
             .value(radius)
             .number("Anisotropy", 0.0f)
             .number("IOR", 1.4f)
             .number("Roughness", 1.0f)
             .constant(subsurface_rules(c, n, "falloff", generation).pack()));
}

void toon(Compiler& c, int n, const Value& w) {
  const bool glossy = c.text(n, "component", "DIFFUSE") == "GLOSSY";
  simple(c, n, w, glossy ? ClosureKind::glossy_toon : ClosureKind::toon,
         Parameters(c, n).color("Color", Color(0.8f)).number("Size", 0.5f).number("Smooth", 0.0f));
}

void portal(Compiler& c, int n, const Value& w) {
  ClosureUse use{};
  use.kind = ClosureKind::portal;
  Parameters p(c, n);
  p.color("Color", Color(1.0f)).value(c.vector(n, "Position", Vec3(0.0f), 0));
  p.constant(c.is_linked(n, "Position") ? 1.0f : 0.0f).value(c.vector(n, "Direction", Vec3(0.0f), 0));
  c.add_closure(use, w, {}, p.values());
}

constexpr float k_default_tilt_rad = 2.0f * k_pi / 180.0f;

// On meshes the hair lies along the bitangent, without tilt, unless a tangent is given.
void hair(Compiler& compiler, int node, const Value& weight) {
  ClosureUse use{};
  use.kind = compiler.text(node, "component", "Reflection") == "Transmission" ? ClosureKind::hair_transmission
                                                                              : ClosureKind::hair_reflection;
  Expressions& e = compiler.expressions();
  std::vector<Value> normals;
  const bool given = compiler.is_linked(node, "Tangent");
  normals.push_back(given ? compiler.vector(node, "Tangent", Vec3(0.0f), 0) : e.operation(Op::bitangent, 0, {}, 3));
  use.has_tangent = true;
  Parameters p(compiler, node);
  p.color("Color", Color(0.8f)).number("RoughnessU", 0.1f).number("RoughnessV", 1.0f);
  const Value tilt = compiler.number(node, "Offset", 0.0f, 0);
  std::vector<Value> values = p.values();
  values.push_back(given ? e.operation(Op::multiply, 0, {tilt, e.number(-1.0f)}, 1) : e.number(0.0f));
  compiler.add_closure(use, weight, normals, values);
}

void principled_hair(Compiler& compiler, int node, const Value& weight) {
  const std::string meaning = compiler.text(node, "parametrization", "COLOR");
  const bool huang = compiler.text(node, "model", "CHIANG") == "HUANG";
  ClosureUse use{};
  use.kind = huang ? ClosureKind::hair_microfacets : ClosureKind::hair_fibre;
  Parameters p(compiler, node);
  if (meaning == "ABSORPTION")
    p.color("Absorption Coefficient", Color(0.245531f, 0.52f, 1.365f));
  else if (meaning == "MELANIN")
    p.color("Tint", Color(1.0f));
  else
    p.color("Color", Color(0.017513f, 0.005763f, 0.002059f));
  p.constant(static_cast<float>(meaning == "ABSORPTION" ? HairColor::absorption
                                : meaning == "MELANIN"  ? HairColor::melanin
                                                        : HairColor::reflectance));
  p.number("Melanin", 0.8f).number("Melanin Redness", 1.0f).number("Roughness", 0.3f);
  p.number(huang ? "Roughness" : "Radial Roughness", 0.3f);
  if (huang)
    p.constant(0.0f);
  else
    p.number("Coat", 0.0f);
  p.number("IOR", 1.55f).number("Offset", k_default_tilt_rad).number("Random", 0.0f);
  p.number("Random Color", 0.0f).number("Random Roughness", 0.0f);
  if (huang) p.number("Aspect Ratio", 0.85f).number("R lobe", 1.0f).number("TT lobe", 1.0f).number("TRT lobe", 1.0f);
  compiler.add_closure(use, weight, {}, p.values());
}

using ClosureNode = void (*)(Compiler&, int node, const Value& weight);

const std::map<std::string, ClosureNode>& closure_nodes() {
  static const std::map<std::string, ClosureNode> nodes{
      {"BsdfPrincipled", principled},
      {"BsdfDiffuse",
       [](Compiler& c, int n, const Value& w) {
         simple(c, n, w, ClosureKind::diffuse,
                Parameters(c, n)
                    .color("Color", Color(0.8f))
                    .number("Roughness", 0.0f)
                    .constant(c.follows(403) ? 2.0f : 1.0f));
       }},
      {"BsdfGlossy", glossy},
      {"BsdfAnisotropic", glossy},
      {"BsdfMetallic", metallic},
      {"BsdfGlass",
       [](Compiler& c, int n, const Value& w) {
         simple(c, n, w, ClosureKind::glass,
                Parameters(c, n)
                    .color("Color", Color(1.0f))
                    .number("Roughness", 0.0f)
                    .number("IOR", 1.45f)
                    .constant(c.follows(400) ? 2.0f : 1.0f)
                    .film(),
                gloss_model(c, n, "GGX"));
       }},
      {"BsdfRefraction",
       [](Compiler& c, int n, const Value& w) {
         simple(c, n, w, ClosureKind::refraction,
                Parameters(c, n).color("Color", Color(1.0f)).number("Roughness", 0.0f).number("IOR", 1.45f),
                gloss_model(c, n, "GGX"));
       }},
      {"BsdfTranslucent",
       [](Compiler& c, int n, const Value& w) {
         simple(c, n, w, ClosureKind::translucent, Parameters(c, n).color("Color", Color(0.8f)));
       }},
      {"BsdfTransparent",
       [](Compiler& c, int n, const Value& w) {
         simple(c, n, w, ClosureKind::transparent, Parameters(c, n).color("Color", Color(1.0f)));
       }},
      {"BsdfVelvet",
       [](Compiler& c, int n, const Value& w) {
         simple(c, n, w, ClosureKind::velvet, Parameters(c, n).color("Color", Color(0.8f)).number("Sigma", 1.0f));
       }},
      {"BsdfSheen",
       [](Compiler& c, int n, const Value& w) {
         const bool velvet = c.text(n, "distribution", "MICROFIBER") == "ASHIKHMIN";
         simple(c, n, w, velvet ? ClosureKind::velvet : ClosureKind::sheen,
                Parameters(c, n).color("Color", Color(0.8f)).number("Roughness", 0.5f));
       }},
      {"SubsurfaceScattering", subsurface},
      {"BsdfToon", toon},
      {"BsdfRayPortal", portal},
      {"BsdfHair", hair},
      {"BsdfHairPrincipled", principled_hair},
      {"Holdout",
       [](Compiler& c, int n, const Value& w) {
         ClosureUse use{};
         use.kind = ClosureKind::holdout;
         c.add_closure(use, w, {}, Parameters(c, n).constant(1.0f).constant(1.0f).constant(1.0f).values());
       }},
      {"Emission",
       [](Compiler& c, int n, const Value& w) {
         add_emission(c, n, c.color(n, "Color", Color(1.0f), 0), c.number(n, "Strength", 1.0f, 0), w);
       }},
      {"Background",
       [](Compiler& c, int n, const Value& w) {
         add_emission(c, n, c.color(n, "Color", Color(0.8f), 0), c.number(n, "Strength", 1.0f, 0), w);
       }},
  };
  return nodes;
}

const std::map<std::string, ClosureNode>& stand_ins() {
  static const std::map<std::string, ClosureNode> nodes{
      {"EeveeSpecular",
       [](Compiler& c, int n, const Value& w) {
         c.warn_unsupported(n, "it is rendered as diffuse reflection of its base colour");
         Parameters p(c, n);
         p.color("Base Color", Color(0.8f)).constant(0.0f);
         simple(c, n, w, ClosureKind::diffuse, p);
       }},
      {"VolumePrincipled",
       [](Compiler& c, int n, const Value&) { c.warn_unsupported(n, "a volume on a surface does nothing"); }},
      {"VolumeScatter",
       [](Compiler& c, int n, const Value&) { c.warn_unsupported(n, "a volume on a surface does nothing"); }},
      {"VolumeAbsorption",
       [](Compiler& c, int n, const Value&) { c.warn_unsupported(n, "a volume on a surface does nothing"); }},
  };
  return nodes;
}

}  // namespace

bool compile_closure_node(Compiler& compiler, int node, const Value& weight) {
  const std::string& type = compiler.node(node).type;
  for (const auto* nodes : {&closure_nodes(), &stand_ins()})
    if (const auto found = nodes->find(type); found != nodes->end()) {
      found->second(compiler, node, weight);
      return true;
    }
  return false;
}

std::vector<std::string> closure_node_types() {
  std::vector<std::string> types;
  for (const auto& [type, definition] : closure_nodes()) types.push_back(type);
  return types;
}

}  // namespace lambent
