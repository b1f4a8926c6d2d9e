#include "engine/shading/program.h"

#include <algorithm>

#include "engine/shading/lobe_functions.h"
#include "engine/shading/node_math.h"
#include "engine/shading/program_data.h"

namespace lambent {
namespace {

// What a closure instruction adds to, by what was asked.
struct SurfaceSink {
  Bsdf& bsdf;
  const ShadingPoint& point;
  Vec3 default_normal{0.0f};  // made valid on first use
  bool has_default_normal = false;

  const Vec3& normal() {
    if (!has_default_normal) {
      default_normal = valid_reflection_normal(point.ng_world, point.wi_world, point.ns_world);
      has_default_normal = true;
    }
    return default_normal;
  }
};

const float* at(const ProgramData& program, const float* registers, Operand operand) {
  return operand >= 0 ? registers + operand : program.constants.data() + ~operand;
}
Vec3 vector_at(const ProgramData& program, const float* registers, Operand operand) {
  const float* p = at(program, registers, operand);
  return {p[0], p[1], p[2]};
}

// A usable normal from the graph: unit, or the default.
Vec3 checked_normal(const ShadingPoint& point, const Vec3& n, const Vec3& otherwise) {
  const Vec3 unit = is_finite(n) ? normalize(n) : Vec3(0.0f);
  if (length_squared(unit) == 0.0f) return otherwise;
  return valid_reflection_normal(point.ng_world, point.wi_world, unit);
}

void add_closure(const ProgramData& program, const Instruction& instruction, const float* registers,
                 SurfaceSink& sink) {
  const ClosureUse& use = program.closures[instruction.data];
  const Operand* operand = program.operands.data() + instruction.operands;
  const float weight = *at(program, registers, *operand++);
  if (!(weight > 0.0f)) return;
  const ShadingPoint& point = sink.point;
  Vec3 n, coat_normal, tangent(0.0f);
  n = use.has_normal ? checked_normal(point, vector_at(program, registers, *operand++), point.ns_world) : sink.normal();
  coat_normal = use.has_coat_normal ? checked_normal(point, vector_at(program, registers, *operand++), point.ns_world)
                                    : sink.normal();
  Vec3 diffuse_normal = n;
  if (use.raw_diffuse_normal) {
    const Vec3 raw =
        use.has_normal ? vector_at(program, registers, program.operands[instruction.operands + 1]) : point.ns_world;
    if (is_finite(raw) && length_squared(raw) > 0.0f) diffuse_normal = normalize(raw);
  }
  if (use.bumped_by_displacement) sink.bsdf.set_shading_normal(diffuse_normal);
  // One that looks away stays bent where a lobe has to be on the side of the view.
  const bool looks_away = dot(diffuse_normal, point.wi_world) <= 0.0f;
  if (use.has_tangent) tangent = vector_at(program, registers, *operand++);
  if (use.has_shading_normal) {
    const Vec3 bumped = vector_at(program, registers, *operand++);
    if (is_finite(bumped) && length_squared(bumped) > 0.0f) sink.bsdf.set_shading_normal(normalize(bumped));
  }

  const auto add = [&](const LobeTemplates& templates, bool sanitized) {
    if (!is_black(templates.emission)) sink.bsdf.add_emission(templates.emission * weight);
    if (!is_black(templates.holdout)) sink.bsdf.add_holdout(templates.holdout * weight);
    for (int i = 0; i < templates.count; ++i) {
      const LobeTemplates::Entry& entry = templates.entries[i];
      Lobe lobe = entry.lobe;
      lobe.weight *= weight;
      lobe.correlated_masking = program.correlated_masking;
      if (program.fitted_films) {
        lobe.fitted_film = true;
        if (lobe.fresnel == FresnelMode::film_f82) lobe.fresnel = FresnelMode::f82;
      }
      if (lobe.kind == LobeKind::portal) {
        lobe.tangent = lobe.param != 0.0f ? lobe.tangent - point.origin_shift : point.p_world;
        if (length_squared(lobe.n) == 0.0f) lobe.n = point.wi_world * -1.0f;
        sink.bsdf.add_sanitized(Bsdf::sanitized(lobe));
        continue;
      }
      lobe.n = entry.coat ? coat_normal : n;
      if (is_fibre(lobe.kind)) {
        lobe.n = point.ng_world;
        lobe.tangent = normalize(point.dpdu_world);
      }
      if (is_diffuse(lobe.kind) && (!looks_away || lobe.kind == LobeKind::diffuse)) lobe.n = diffuse_normal;
      if (entry.anisotropic)
        lobe.tangent = entry.rotation != 0.0f ? rotate_around_axis(tangent, n, entry.rotation * 2.0f * k_pi) : tangent;
      sink.bsdf.add_sanitized(sanitized ? lobe : Bsdf::sanitized(lobe));
    }
  };
  if (use.constant) {
    add(point.backfacing ? use.back : use.front, true);
  } else {
    float parameters[k_max_closure_parameters];
    for (int i = 0; i < use.parameter_count; ++i) parameters[i] = *at(program, registers, operand[i]);
    LobeTemplates made;
    make_lobes(use.kind, use.model, parameters, point.backfacing, std::fabs(dot(n, point.wi_world)), made);
    add(made, false);
  }
}

// Emission or transparency of one closure, as asked; weight included.
Color sum_closure(const ProgramData& program, const Instruction& instruction, const float* registers,
                  const ShadingPoint& point, Ask ask) {
  const ClosureUse& use = program.closures[instruction.data];
  const Operand* operand = program.operands.data() + instruction.operands;
  const float weight = *at(program, registers, *operand++);
  if (!(weight > 0.0f)) return Color(0.0f);
  const Operand* const normal = operand;
  operand += use.has_normal + use.has_coat_normal + use.has_tangent + use.has_shading_normal;
  float parameters[k_max_closure_parameters];
  for (int i = 0; i < use.parameter_count; ++i) parameters[i] = *at(program, registers, operand[i]);
  Color color(parameters[0], parameters[1], parameters[2]);
  if (use.kind == ClosureKind::principled_2) {
    LobeTemplates made;
    Vec3 n = use.has_normal ? vector_at(program, registers, *normal) : point.ns_world;
    make_lobes(use.kind, use.model, parameters, point.backfacing, std::fabs(dot(n, point.wi_world)), made);
    color = made.emission;
    if (ask == Ask::transparency) {
      color = Color(0.0f);
      for (int i = 0; i < made.count; ++i)
        if (const Lobe lobe = Bsdf::sanitized(made.entries[i].lobe); lobe.kind == LobeKind::transparent)
          color += lobe.weight;
    }
  } else if (use.kind == ClosureKind::transparent) {
    color = Color(std::max(color.x, 0.0f), std::max(color.y, 0.0f), std::max(color.z, 0.0f));
  }
  color *= weight;
  return is_finite(color) ? color : Color(0.0f);
}

/// @param aovs null: the code has none
template <int registers_count, bool with_aovs>
void run_surface(const ProgramData& program, const Code& code, const ShadingPoint& point, const TextureSystem* textures,
                 Bsdf& bsdf, AovValue* aovs) {
  float registers[registers_count];
  SurfaceSink sink{bsdf, point, Vec3(0.0f), false};
  for (const Instruction& instruction : code.instructions) {
    if (instruction.op != Op::closure) {
      run_instruction(program, instruction, point, textures, registers);
    } else if (with_aovs && instruction.data >= program.first_aov_closure) {
      const uint32_t number = instruction.data - program.first_aov_closure;
      const Operand* const operand = program.operands.data() + instruction.operands;  // a weight of 1 first
      Color value;
      for (int k = 0; k < 3; ++k) value[k] = *at(program, registers, operand[k + 1]);
      if (!is_finite(value)) value = Color(0.0f);
      if (number % 2 == 0)
        aovs[number / 2].color = value;
      else
        aovs[number / 2].number = value.x;
    } else if (program.closures[instruction.data].kind == ClosureKind::emission) {
      bsdf.add_emission(sum_closure(program, instruction, registers, point, Ask::emission));
    } else {
      add_closure(program, instruction, registers, sink);
    }
  }
}

template <bool with_aovs>
void run_surface(const ProgramData& program, const Code& code, const ShadingPoint& point, const TextureSystem* textures,
                 Bsdf& bsdf, AovValue* aovs) {
  if (code.register_floats <= 64)
    run_surface<64, with_aovs>(program, code, point, textures, bsdf, aovs);
  else if (code.register_floats <= 512)
    run_surface<512, with_aovs>(program, code, point, textures, bsdf, aovs);
  else
    run_surface<k_max_registers, with_aovs>(program, code, point, textures, bsdf, aovs);
}

template <int registers_count>
Color run_sum(const ProgramData& program, const Code& code, const ShadingPoint& point, const TextureSystem* textures,
              Ask ask) {
  float registers[registers_count];
  Color sum(0.0f);
  for (const Instruction& instruction : code.instructions) {
    if (instruction.op != Op::closure)
      run_instruction(program, instruction, point, textures, registers);
    else
      sum += sum_closure(program, instruction, registers, point, ask);
  }
  return sum;
}

Color sum_code(const ProgramData& program, const Code& code, const ShadingPoint& point, const TextureSystem* textures,
               Ask ask) {
  if (code.instructions.empty()) return Color(0.0f);
  if (code.register_floats <= 64) return run_sum<64>(program, code, point, textures, ask);
  if (code.register_floats <= 512) return run_sum<512>(program, code, point, textures, ask);
  return run_sum<k_max_registers>(program, code, point, textures, ask);
}

}  // namespace

Program::Program(std::unique_ptr<const ProgramData> data)
    : data_(std::move(data)), traits_(data_->traits), aov_count_(static_cast<int>(data_->aovs.size())) {}
Program::~Program() = default;

std::span<const AttributeRequest> Program::attribute_requests() const { return data_->requests; }

void Program::evaluate(const ShadingPoint& point, const TextureSystem* textures, Bsdf& bsdf) const {
  bsdf.begin(point);
  bsdf.set_bump_shadowing(data_->bump_shadowing);
  run_surface<false>(*data_, data_->surface, point, textures, bsdf, nullptr);
}

void Program::evaluate_with_aovs(const ShadingPoint& point, const TextureSystem* textures, Bsdf& bsdf,
                                 std::span<AovValue> aovs) const {
  bsdf.begin(point);
  bsdf.set_bump_shadowing(data_->bump_shadowing);
  std::fill(aovs.begin(), aovs.end(), AovValue());
  run_surface<true>(*data_, data_->surface_with_aovs, point, textures, bsdf, aovs.data());
}

Color Program::transparency(const ShadingPoint& point, const TextureSystem* textures) const {
  return sum_code(*data_, data_->transparency, point, textures, Ask::transparency);
}

Color Program::emission(const ShadingPoint& point, const TextureSystem* textures) const {
  if (traits_.constant_emission) return traits_.emission;
  return sum_code(*data_, data_->emission, point, textures, Ask::emission);
}

namespace {

template <int registers_count>
Vec3 run_displacement(const ProgramData& program, const ShadingPoint& point, const TextureSystem* textures) {
  float registers[registers_count];
  for (const Instruction& instruction : program.displacement.instructions) {
    if (instruction.op != Op::closure) {
      run_instruction(program, instruction, point, textures, registers);
      continue;
    }
    const Operand* operand = program.operands.data() + instruction.operands;
    return {*at(program, registers, operand[0]), *at(program, registers, operand[1]),
            *at(program, registers, operand[2])};
  }
  return Vec3(0.0f);
}

}  // namespace

Vec3 Program::displacement(const ShadingPoint& point, const TextureSystem* textures) const {
  const int floats = data_->displacement.register_floats;
  const Vec3 offset = floats <= 64    ? run_displacement<64>(*data_, point, textures)
                      : floats <= 512 ? run_displacement<512>(*data_, point, textures)
                                      : run_displacement<k_max_registers>(*data_, point, textures);
  return data_->displaces_in_object_space || !point.object_from_world ? offset
                                                                      : point.object_from_world->vector(offset);
}

bool same_displacement(const Program& a, const Program& b) {
  const ProgramData &x = *a.data_, &y = *b.data_;
  return x.displacement.instructions == y.displacement.instructions && x.operands == y.operands &&
         x.constants == y.constants && x.textures == y.textures && x.tables == y.tables && x.voronois == y.voronois &&
         x.requests == y.requests && x.met_attributes == y.met_attributes &&
         x.displaces_in_object_space == y.displaces_in_object_space && x.bump_filter_width == y.bump_filter_width;
}

int Program::find_aov(std::string_view name) const {
  const auto found = std::find(data_->aovs.begin(), data_->aovs.end(), name);
  return found == data_->aovs.end() ? -1 : static_cast<int>(found - data_->aovs.begin());
}

std::vector<TextureHandle> Program::images() const {
  std::vector<TextureHandle> images;
  for (const TextureUse& use : data_->textures)
    if (use.texture) images.push_back(use.texture);
  return images;
}

size_t Program::bytes() const {
  size_t sum = sizeof(*this) + sizeof(ProgramData);
  for (const Code* code :
       {&data_->surface, &data_->surface_with_aovs, &data_->transparency, &data_->emission, &data_->displacement})
    sum += code->instructions.capacity() * sizeof(Instruction);
  sum += data_->operands.capacity() * sizeof(Operand) + data_->constants.capacity() * sizeof(float);
  sum += data_->textures.capacity() * sizeof(TextureUse) + data_->closures.capacity() * sizeof(ClosureUse);
  for (const std::vector<float>& table : data_->tables) sum += table.capacity() * sizeof(float);
  return sum;
}

}  // namespace lambent
