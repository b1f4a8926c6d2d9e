#include "engine/shading/compiler.h"

#include <algorithm>

#include "engine/base/hash.h"

namespace lambent {

Compiler::Compiler(const ShaderGraph& graph, Subject subject, const std::string& name, const ImageResolver& images,
                   Report& report)
    : graph_(graph), subject_(subject), name_(name), images_(images), report_(report), expressions_(*program_) {
  program_->world = subject == Subject::world;
}

namespace {

bool reads_view(Op op) {
  switch (op) {
    case Op::incoming:
    case Op::reflection:
    case Op::fresnel:
    case Op::layer_weight_fresnel:
    case Op::layer_weight_facing:
      return true;
    default:
      return false;
  }
}
/// What rays of its own find differs from one evaluation to the next, so that no two walks may share it.
bool casts_rays(Op op) { return op == Op::ambient_occlusion || op == Op::bevel || op == Op::raycast; }
bool reads_path(Op op) { return op == Op::light_path || op == Op::light_falloff || casts_rays(op); }

}  // namespace

// --- Reading the graph -----------------------------------------------------------------------------------------------

std::string Compiler::subject_text(int index) const {
  static constexpr const char* k_kinds[] = {"Material", "World", "Light"};
  return std::string(k_kinds[static_cast<int>(subject_)]) + " '" + name_ + "', node '" + node(index).name + "' (" +
         node(index).type + ")";
}

void Compiler::warn_unsupported(int index, const std::string& what) {
  if (reported_.insert({index, what}).second)
    report_.warning("unsupported", name_, subject_text(index) + ": " + what + ".");
}

TypedValue Compiler::output(const GraphLink& link, int shift) {
  const TypedValue black{expressions_.vector(Vec3(0.0f)), SocketKind::color};
  if (link.node < 0 || link.node >= static_cast<int>(graph_.nodes.size())) {
    report_.warning("broken_graph", name_,
                    "A link in the shader of '" + name_ + "' leads to a node that does not exist.");
    return black;
  }
  const MemoKey key{link.node, link.socket, shift};
  if (const auto known = memo_.find(key); known != memo_.end()) return known->second;
  if (std::find(path_.begin(), path_.end(), link.node) != path_.end()) {
    std::string loop;
    for (auto at = std::find(path_.begin(), path_.end(), link.node); at != path_.end(); ++at)
      loop += (loop.empty() ? "'" : ", '") + node(*at).name + "'";
    if (reported_.insert({link.node, "loop"}).second)
      report_.warning("broken_graph", name_,
                      subject_text(link.node) + ": the nodes " + loop + " form a loop, which is cut here.");
    return black;
  }
  path_.push_back(link.node);
  TypedValue result = black;
  const auto& definitions = value_nodes();
  if (const auto definition = definitions.find(node(link.node).type); definition != definitions.end()) {
    result = definition->second(*this, link.node, link.socket, shift);
  } else {
    warn_unsupported(link.node, "its output '" + link.socket + "' cannot be computed, mid-grey takes its place");
    result = {expressions_.vector(Vec3(0.5f)), SocketKind::color};
  }
  path_.pop_back();
  memo_[key] = result;
  return result;
}

Value Compiler::to_number(const TypedValue& value) {
  switch (value.kind) {
    case SocketKind::number:
      return value.value;
    case SocketKind::color:
      return expressions_.operation(Op::luminance, 0, {value.value}, 1);
    case SocketKind::vector:
      return expressions_.operation(Op::average, 0, {value.value}, 1);
  }
  return value.value;
}

Value Compiler::to_vector(const TypedValue& value) {
  if (value.kind != SocketKind::number) return value.value;
  return expressions_.operation(Op::combine, 0, {value.value, value.value, value.value}, 3);
}

const GraphValue* Compiler::find_input(int index, const char* socket) const {
  const auto& inputs = node(index).inputs;
  auto found = inputs.find(socket);
  // The one socket whose name differs between versions of Blender
  if (found == inputs.end() && std::string_view(socket) == "Fac") found = inputs.find("Factor");
  return found == inputs.end() ? nullptr : &found->second;
}

float Compiler::finite(int index, const char* socket, float x, float otherwise) {
  if (std::isfinite(x)) return x;
  if (reported_.insert({index, socket}).second)
    report_.warning("bad_value", name_,
                    subject_text(index) + ": its input '" + socket + "' is not a finite number, " +
                        std::to_string(otherwise) + " takes its place.");
  return otherwise;
}

void Compiler::filter_bumps(float width_px) {
  const float width = std::isfinite(width_px) ? std::clamp(width_px, 1e-3f, 100.0f) : 1.0f;
  program_->bump_filter_width = bump_is_filtered_ ? std::min(program_->bump_filter_width, width) : width;
  bump_is_filtered_ = true;
}

Value Compiler::number(int index, const char* socket, float otherwise, int shift) {
  const GraphValue* input = find_input(index, socket);
  if (!input) return expressions_.number(otherwise);
  if (const auto* link = std::get_if<GraphLink>(input)) return to_number(output(*link, shift));
  if (const auto* x = std::get_if<float>(input)) return expressions_.number(finite(index, socket, *x, otherwise));
  if (const auto* b = std::get_if<bool>(input)) return expressions_.number(*b ? 1.0f : 0.0f);
  if (const auto* v = std::get_if<GraphNumbers>(input))
    if (!v->empty()) return expressions_.number(finite(index, socket, (*v)[0], otherwise));
  return expressions_.number(otherwise);
}

Value Compiler::vector(int index, const char* socket, const Vec3& otherwise, int shift) {
  const GraphValue* input = find_input(index, socket);
  if (!input) return expressions_.vector(otherwise);
  if (const auto* link = std::get_if<GraphLink>(input)) return to_vector(output(*link, shift));
  if (const auto* x = std::get_if<float>(input))
    return expressions_.vector(Vec3(finite(index, socket, *x, otherwise.x)));
  if (const auto* v = std::get_if<GraphNumbers>(input)) {
    const auto at = [&](int i) {
      return i < static_cast<int>(v->size()) ? finite(index, socket, (*v)[i], otherwise[i]) : 0.0f;
    };
    return expressions_.vector({at(0), at(1), at(2)});
  }
  return expressions_.vector(otherwise);
}

Value Compiler::color(int index, const char* socket, const Color& otherwise, int shift) {
  return vector(index, socket, otherwise, shift);
}

bool Compiler::is_linked(int index, const char* socket) const {
  const GraphValue* input = find_input(index, socket);
  return input && std::holds_alternative<GraphLink>(*input);
}
bool Compiler::has_input(int index, const char* socket) const { return find_input(index, socket) != nullptr; }
const std::string* Compiler::input_text(int index, const char* socket) const {
  const GraphValue* input = find_input(index, socket);
  return input ? std::get_if<std::string>(input) : nullptr;
}

bool Compiler::output_used(int index, const char* socket) const {
  for (const GraphNode& other : graph_.nodes)
    for (const auto& [name, value] : other.inputs)
      if (const auto* link = std::get_if<GraphLink>(&value); link && link->node == index && link->socket == socket)
        return true;
  return false;
}

Value Compiler::vector_or(int index, const char* socket, int shift, Value (Compiler::*otherwise)(int)) {
  return is_linked(index, socket) ? vector(index, socket, Vec3(0.0f), shift) : (this->*otherwise)(shift);
}

std::string Compiler::text(int index, const char* property, const char* otherwise) const {
  const auto& properties = node(index).properties;
  const auto found = properties.find(property);
  if (found == properties.end()) return otherwise;
  const auto* value = std::get_if<std::string>(&found->second);
  return value ? *value : otherwise;
}
float Compiler::property(int index, const char* property, float otherwise) const {
  const auto found = node(index).properties.find(property);
  if (found == node(index).properties.end()) return otherwise;
  if (const auto* x = std::get_if<float>(&found->second)) return std::isfinite(*x) ? *x : otherwise;
  if (const auto* b = std::get_if<bool>(&found->second)) return *b ? 1.0f : 0.0f;
  return otherwise;
}
bool Compiler::flag(int index, const char* property, bool otherwise) const {
  return this->property(index, property, otherwise ? 1.0f : 0.0f) != 0.0f;
}

int Compiler::choice(int index, const char* property, const std::vector<const char*>& names) {
  const std::string value = text(index, property, names[0]);
  for (size_t i = 0; i < names.size(); ++i)
    if (value == names[i]) return static_cast<int>(i);
  warn_unsupported(index, std::string(property) + " '" + value + "' is not known, '" + names[0] + "' takes its place");
  return 0;
}

// --- What unconnected inputs stand for -------------------------------------------------------------------------------

Value Compiler::attribute(AttributeRequest::Kind kind, const std::string& name, int shift) {
  // As where a mesh has none of that name.
  const float alpha = kind == AttributeRequest::Kind::named ? 1.0f : 0.0f;
  if (!on_mesh()) return expressions_.vector4({0, 0, 0, alpha});
  const AttributeRequest request{kind, name};
  auto& requests = program_->requests;
  auto found = std::find(requests.begin(), requests.end(), request);
  if (found == requests.end()) {
    if (requests.size() >= k_max_attributes) {
      if (reported_.insert({-1, "attributes"}).second)
        report_.warning("unsupported", name_,
                        "The shader of '" + name_ + "' reads more than " + std::to_string(k_max_attributes) +
                            " attributes; '" + name + "' and later ones count as 0.");
      return expressions_.vector4({0, 0, 0, alpha});
    }
    requests.push_back(request);
    found = requests.end() - 1;
  }
  if (shift) program_->traits.needs_differentials = true;
  return expressions_.operation(Op::attribute, shift, {}, 4, static_cast<uint32_t>(found - requests.begin()));
}

Value Compiler::uv(int shift) {
  if (is_world()) return expressions_.vector(Vec3(0.0f));
  return expressions_.part(attribute(AttributeRequest::Kind::uv, "", shift), 0, 3);
}
Value Compiler::generated(int shift) {
  if (is_world()) return position(shift);
  if (!on_mesh()) return object_position(shift);
  return expressions_.part(attribute(AttributeRequest::Kind::generated, "", shift), 0, 3);
}
Value Compiler::position(int shift) {
  if (undisplaced_)
    return expressions_.part(attribute(AttributeRequest::Kind::undisplaced, follows(500) ? "" : "compact", shift), 0,
                             3);
  if (shift) program_->traits.needs_differentials = true;
  return expressions_.operation(Op::position, shift, {}, 3);
}
Value Compiler::object_position(int shift) {
  constexpr int k_point_to_object = 12;  // Op::vector_transform's variant
  if (undisplaced_) return expressions_.operation(Op::vector_transform, k_point_to_object, {position(shift)}, 3);
  if (shift) program_->traits.needs_differentials = true;
  return expressions_.operation(Op::object_position, shift, {}, 3);
}
Value Compiler::normal(int) {
  if (bumped_normal_.expression >= 0) return bumped_normal_;
  return expressions_.operation(Op::normal, 0, {}, 3);
}
Value Compiler::object_normal(int) { return expressions_.operation(Op::object_normal, 0, {}, 3); }
Value Compiler::tangent(int shift) { return expressions_.operation(Op::default_tangent, 0, {generated(shift)}, 3); }

uint32_t Compiler::texture(int index, ImageProjection projection) {
  const std::string id = text(index, "image", "");
  TextureUse use;
  use.projection = projection;
  use.projection_blend = property(index, "projection_blend", 0.0f);
  static const std::vector<const char*> interpolations{"Linear", "Closest", "Cubic", "Smart"};
  static constexpr TextureInterpolation k_interpolations[] = {TextureInterpolation::linear,
                                                              TextureInterpolation::closest,
                                                              TextureInterpolation::cubic, TextureInterpolation::cubic};
  use.interpolation = k_interpolations[choice(index, "interpolation", interpolations)];
  static const std::vector<const char*> extensions{"REPEAT", "EXTEND", "CLIP", "MIRROR"};
  static constexpr TextureExtension k_extensions[] = {TextureExtension::repeat, TextureExtension::extend,
                                                      TextureExtension::clip, TextureExtension::mirror};
  use.extension = k_extensions[choice(index, "extension", extensions)];
  use.straight_color = output_used(index, "Alpha");
  const std::string key = id + "|" + std::to_string(index);
  if (const auto known = texture_indices_.find(key); known != texture_indices_.end()) return known->second;
  if (!id.empty() && images_) use.texture = images_(id);
  if (!use.texture)
    report_.error("missing_texture", name_,
                  subject_text(index) + ": " +
                      (id.empty() ? "it has no image" : "the image '" + id + "' does not exist") +
                      ", pink takes its place.");
  const auto place = static_cast<uint32_t>(program_->textures.size());
  program_->textures.push_back(std::move(use));
  texture_indices_[key] = place;
  return place;
}

Value Compiler::computed_color(Op op, const std::vector<Value>& arguments, uint32_t data) {
  Expressions& e = expressions_;
  if (!graph_.scene_from_computed) return e.operation(op, 0, arguments, 3, data);
  const Value color = e.operation(op, 1, arguments, 3, data), zero = e.number(0.0f);
  const auto channel = [&](size_t row) {
    const float* m = graph_.scene_from_computed->data() + 3 * row;
    const Value sum = e.operation(Op::vector_math_float, static_cast<int>(VectorOperation::dot),
                                  {color, e.vector(Vec3(m[0], m[1], m[2]))}, 1);
    return e.operation(Op::math, static_cast<int>(MathOperation::maximum), {sum, zero, zero}, 1);
  };
  return e.operation(Op::combine, 0, {channel(0), channel(1), channel(2)}, 3);
}

// --- Closures
// ----------------------------------------------------------------------------------------------------------

void Compiler::add_closures(const GraphLink& link, const Value& weight) {
  if (expressions_.is_number(weight, 0.0f)) return;
  if (link.node < 0 || link.node >= static_cast<int>(graph_.nodes.size())) {
    report_.warning("broken_graph", name_,
                    "A link in the shader of '" + name_ + "' leads to a node that does not exist.");
    return;
  }
  if (std::find(path_.begin(), path_.end(), link.node) != path_.end()) {
    report_.warning("broken_graph", name_, subject_text(link.node) + ": it is part of a loop, which is cut here.");
    return;
  }
  path_.push_back(link.node);
  const std::string& type = node(link.node).type;
  const auto follow = [&](const char* socket, const Value& share) {
    const auto input = node(link.node).inputs.find(socket);
    if (input == node(link.node).inputs.end()) return;
    if (const auto* next = std::get_if<GraphLink>(&input->second)) add_closures(*next, share);
  };
  if (type == "MixShader") {
    const Value factor = number(link.node, "Fac", 0.5f, 0);
    follow("Shader", expressions_.operation(Op::mix_weight_first, 0, {weight, factor}, 1));
    follow("Shader_001", expressions_.operation(Op::mix_weight_second, 0, {weight, factor}, 1));
  } else if (type == "AddShader") {
    follow("Shader", weight);
    follow("Shader_001", weight);
  } else if (!compile_closure_node(*this, link.node, weight)) {
    // A colour or value plugged into a shader socket emits, as in Blender; anything else is unknown.
    if (value_nodes().contains(type)) {
      ClosureUse use{};
      use.kind = ClosureKind::emission;
      path_.pop_back();  // output() visits the node again
      const Value color = to_vector(output(link, 0));
      path_.push_back(link.node);
      add_closure(use, weight, {},
                  {expressions_.part(color, 0, 1), expressions_.part(color, 1, 1), expressions_.part(color, 2, 1)});
    } else {
      warn_unsupported(link.node, "the shader is not known, a grey diffuse one takes its place");
      ClosureUse use{};
      use.kind = ClosureKind::diffuse;
      const Value grey = color(link.node, "Color", Color(0.8f), 0);
      add_closure(use, weight, {},
                  {expressions_.part(grey, 0, 1), expressions_.part(grey, 1, 1), expressions_.part(grey, 2, 1),
                   expressions_.number(0.0f)});
    }
  }
  path_.pop_back();
}

void Compiler::add_closure(ClosureUse use, const Value& weight, const std::vector<Value>& normals,
                           const std::vector<Value>& parameters) {
  if (expressions_.is_number(weight, 0.0f)) return;
  use.parameter_count = static_cast<int>(parameters.size());
  use.bumped_by_displacement = use.has_normal && has_bumped_normal() && normals[0] == bumped_normal_;
  use.has_shading_normal = use.has_normal && has_bumped_normal() && !use.bumped_by_displacement;
  bool constant = true;
  float values[k_max_closure_parameters] = {};
  for (size_t i = 0; i < parameters.size(); ++i) {
    constant &= expressions_.is_constant(parameters[i]);
    if (expressions_.is_constant(parameters[i])) values[i] = *expressions_.constant(parameters[i]);
  }
  const bool black = constant && values[0] == 0.0f && values[1] == 0.0f && values[2] == 0.0f;
  const bool plain = use.kind != ClosureKind::principled_1 && use.kind != ClosureKind::principled_2 &&
                     use.kind != ClosureKind::metallic && use.kind != ClosureKind::conductor &&
                     use.kind != ClosureKind::hair_fibre && use.kind != ClosureKind::hair_microfacets;
  if (black && plain) return;
  if (constant && !closure_depends_on_view(use.kind)) {
    use.constant = true;
    make_lobes(use.kind, use.model, values, false, 1.0f, use.front);
    make_lobes(use.kind, use.model, values, true, 1.0f, use.back);
    for (LobeTemplates* side : {&use.front, &use.back})
      for (int i = 0; i < side->count; ++i) side->entries[i].lobe = Bsdf::sanitized(side->entries[i].lobe);
  }
  const bool emits =
      use.kind == ClosureKind::emission ||
      (use.kind == ClosureKind::principled_2 &&
       !(expressions_.is_constant(parameters[parameters.size() - 1]) &&
         expressions_.is_constant(parameters[parameters.size() - 2]) &&
         expressions_.is_constant(parameters[parameters.size() - 3]) && values[parameters.size() - 1] == 0.0f &&
         values[parameters.size() - 2] == 0.0f && values[parameters.size() - 3] == 0.0f));
  const bool transparent = use.kind == ClosureKind::transparent;
  use.may_be_transparent |= transparent;
  const int amount = use.kind == ClosureKind::principled_1   ? 3
                     : use.kind == ClosureKind::principled_2 ? 7
                                                             : -1;  // parameter that subsurface lobes need
  const bool subsurface = use.kind == ClosureKind::subsurface ||
                          (amount >= 0 && !expressions_.is_number(parameters[static_cast<size_t>(amount)], 0.0f));
  program_->traits.holdout |= use.kind == ClosureKind::holdout;
  program_->traits.portal |= use.kind == ClosureKind::portal;
  program_->traits.subsurface |= subsurface;
  program_->traits.subsurface_normal |= subsurface && use.has_normal;
  const auto index = static_cast<uint32_t>(program_->closures.size());
  std::vector<Value> operands{weight};
  operands.insert(operands.end(), normals.begin(), normals.end());
  if (use.has_shading_normal) operands.push_back(bumped_normal_);
  operands.insert(operands.end(), parameters.begin(), parameters.end());
  program_->traits.may_be_transparent |= use.may_be_transparent;
  if (use.may_be_transparent) transparency_.push_back({index, operands});
  program_->closures.push_back(std::move(use));
  surface_.push_back({index, operands});
  if (emits) emission_.push_back({index, operands});
  program_->traits.emits |= emits;
  program_->traits.scatters |= !transparent && program_->closures.back().kind != ClosureKind::emission &&
                               program_->closures.back().kind != ClosureKind::holdout;
}

void Compiler::add_aov(int index) {
  const Value color = this->color(index, "Color", Color(0.0f), 0);
  const Value value = number(index, "Value", 0.0f, 0);
  const auto add = [&](const Value& r, const Value& g, const Value& b) {
    ClosureUse use;
    use.kind = ClosureKind::emission;
    use.parameter_count = 3;
    const bool nothing = expressions_.is_number(r, 0.0f) && expressions_.is_number(g, 0.0f) &&
                         expressions_.is_number(b, 0.0f);  // as it is without code
    if (!nothing)
      aovs_.push_back({static_cast<uint32_t>(program_->closures.size()), {expressions_.number(1.0f), r, g, b}});
    program_->closures.push_back(use);
  };
  add(expressions_.part(color, 0, 1), expressions_.part(color, 1, 1), expressions_.part(color, 2, 1));
  add(value, value, value);
  program_->aovs.push_back(text(index, "aov", ""));
}

/// The surface's code with the AOVs; those that do not fit are left out.
void Compiler::generate_aovs() {
  std::vector<Expressions::Closure> all = surface_;
  all.insert(all.end(), aovs_.begin(), aovs_.end());
  for (; !program_->aovs.empty(); program_->aovs.pop_back()) {
    const size_t end = program_->first_aov_closure + 2 * program_->aovs.size();
    while (!all.empty() && all.back().index >= end) all.pop_back();
    program_->surface_with_aovs = {};
    if (expressions_.generate(all, program_->surface_with_aovs)) break;
    report_.warning("unsupported", name_,
                    "The AOV '" + program_->aovs.back() + "' of '" + name_ +
                        "' is left out: what leads to it is too large, so that its passes stay black.");
  }
  for (const Instruction& instruction : program_->surface_with_aovs.instructions)
    program_->traits.casts_rays |= casts_rays(instruction.op);
}

// --- The whole -----------------------------------------------------------------------------------------------------

void Compiler::add_bump() {
  // The displaced height at three points turns the normal. If the vertices are moved too, all of that is as it was
  // before, and in object space (shader_graph.cpp of Cycles).
  const bool both = displaces();
  undisplaced_ = both;
  const TypedValue here = output(*graph_.displacement, 0);
  const Value n = both && follows(500)
                      ? expressions_.part(attribute(AttributeRequest::Kind::undisplaced_normal, "", 0), 0, 3)
                      : expressions_.operation(Op::normal, 0, {}, 3);
  const auto height = [&](const TypedValue& displacement) {
    return expressions_.operation(Op::vector_math_float, static_cast<int>(VectorOperation::dot),
                                  {to_vector(displacement), n}, 1);
  };
  const Value h = height(here), hx = height(output(*graph_.displacement, 1)),
              hy = height(output(*graph_.displacement, 2));
  if (!(h == hx && h == hy)) {
    filter_bumps(follows(405) ? 0.1f : 1.0f);
    std::vector<Value> operands{n, expressions_.number(1.0f), expressions_.number(1.0f), h, hx, hy};
    if (both)
      for (const int shift : {1, 2})
        operands.push_back(expressions_.operation(
            Op::vector_math, static_cast<int>(VectorOperation::subtract),
            {position(shift), position(0), expressions_.vector(Vec3(0.0f)), expressions_.number(1.0f)}, 3));
    const int variant = (follows(400) ? k_bump_newer : 0) | (both ? k_bump_object : 0);
    bumped_normal_ = expressions_.operation(Op::bump, variant, std::move(operands), 3);
    program_->traits.needs_differentials = true;
  }
  undisplaced_ = false;
  memo_.clear();  // values of the unbumped normal and of the position before
}

namespace {

bool reads_orientation(Op op) {
  switch (op) {
    case Op::normal:
    case Op::true_normal:
    case Op::default_tangent:
    case Op::bitangent:
    case Op::reflection:
    case Op::vector_transform:
    case Op::world_tangent:
    case Op::normal_map:
      return true;
    default:
      return false;
  }
}
bool reads_place(Op op) {
  switch (op) {
    case Op::position:
    case Op::object_location:
    case Op::object_index:
    case Op::material_index:
    case Op::object_random:
    case Op::object_color:
      return true;
    default:
      return false;
  }
}
bool reads_camera(Op op) {
  switch (op) {
    case Op::view_distance:
    case Op::view_vector:
    case Op::view_depth:
    case Op::camera_position:
    case Op::window_position:
      return true;
    default:
      return false;
  }
}

}  // namespace

std::shared_ptr<const Program> Compiler::compile_displacement() {
  if (!displaces()) return nullptr;
  constexpr int k_object_to_world = 1;  // Op::vector_transform's variant
  const Value world = to_vector(output(*graph_.displacement, 0));
  const Value offset = expressions_.argument_of(world, Op::vector_transform, k_object_to_world);
  program_->displaces_in_object_space = !(offset == world);
  std::vector<Value> parts;
  bool zero = true;
  for (int k = 0; k < 3; ++k) {
    parts.push_back(expressions_.part(offset, k, 1));
    zero = zero && expressions_.is_number(parts.back(), 0.0f);
  }
  if (zero) return nullptr;
  if (!expressions_.generate({{0, parts}}, program_->displacement)) {
    report_.error("unsupported", name_,
                  "The displacement of '" + name_ + "' is too large; its meshes stay as they are.");
    return nullptr;
  }
  ProgramTraits& traits = program_->traits;
  traits.reads_place = expressions_.depends_on(parts, reads_place);
  traits.reads_orientation = !program_->displaces_in_object_space || expressions_.depends_on(parts, reads_orientation);
  for (const AttributeRequest& request : program_->requests) {
    traits.reads_place |= request.kind == AttributeRequest::Kind::object;
    traits.reads_orientation |= request.kind == AttributeRequest::Kind::tangent;
  }
  if (expressions_.depends_on(parts, reads_camera))
    report_.warning(
        "unsupported", name_,
        "The displacement of '" + name_ + "' reads the camera, which is taken to be at the world's origin.");
  return std::make_shared<Program>(std::move(program_));
}

std::shared_ptr<const Program> Compiler::compile() {
  if (graph_.volume) {
    report_.warning("unsupported", name_, "The volume of '" + name_ + "' is not rendered yet; its surface is.");
  }
  if (graph_.displacement && subject_ == Subject::material &&
      graph_.displacement_method != DisplacementMethod::displacement)
    add_bump();
  if (graph_.surface) add_closures(*graph_.surface, expressions_.number(1.0f));
  program_->first_aov_closure = static_cast<uint32_t>(program_->closures.size());
  for (const int index : graph_.aovs)
    if (subject_ == Subject::world)
      warn_unsupported(index, "passes do not show what worlds give them: they are black there");
    else
      add_aov(index);
  return finish();
}

std::shared_ptr<const Program> Compiler::finish() {
  ProgramTraits& traits = program_->traits;
  program_->bump_shadowing = !graph_.bump_map_correction ? BumpShadowing::none
                             : follows(405)              ? BumpShadowing::masking
                                                         : BumpShadowing::cubic;
  traits.transparent_shadow = graph_.transparent_shadow;
  program_->correlated_masking = follows(305);
  program_->fitted_films = follows(400) && !follows(500);
  if (traits.portal) {  // What is behind shines through the other closures to the camera, but no light comes that way
    transparency_.clear();
    traits.may_be_transparent = false;
  }
  // Constants need no code: their lobes are ready.
  for (auto* list : {&surface_})
    for (Expressions::Closure& closure : *list) {
      const ClosureUse& use = program_->closures[closure.index];
      if (use.constant && use.kind != ClosureKind::emission)
        closure.operands.resize(closure.operands.size() - use.parameter_count);
    }
  const bool fits = expressions_.generate(surface_, program_->surface) &&
                    expressions_.generate(transparency_, program_->transparency) &&
                    expressions_.generate(emission_, program_->emission);
  if (!fits) {
    report_.error("unsupported", name_, "The shader of '" + name_ + "' is too large; a grey one takes its place.");
    return default_material();
  }
  for (const auto* list : {&surface_, &transparency_})
    for (const Expressions::Closure& closure : *list) {
      const ClosureUse& use = program_->closures[closure.index];
      traits.path_dependent |= expressions_.depends_on(closure.operands, reads_path);
      traits.casts_rays |= expressions_.depends_on(closure.operands, casts_rays);
      if (use.kind == ClosureKind::emission) continue;
      const bool layered = closure_depends_on_view(use.kind) && !use.constant;
      traits.view_dependent |= layered || expressions_.depends_on(closure.operands, reads_view);
    }
  if (!program_->aovs.empty()) generate_aovs();
  if (traits.emits) {
    traits.constant_emission = true;
    Color sum(0.0f);
    for (const Expressions::Closure& closure : emission_) {
      const ClosureUse& use = program_->closures[closure.index];
      for (const Value& operand : closure.operands) traits.emits_negative |= !expressions_.never_negative(operand);
      bool constant = use.kind == ClosureKind::emission;
      for (const Value& operand : closure.operands) constant &= expressions_.is_constant(operand);
      if (!constant) {
        traits.constant_emission = false;
        continue;
      }
      const float weight = *expressions_.constant(closure.operands[0]);
      for (int k = 0; k < 3; ++k) sum[k] += weight * *expressions_.constant(closure.operands[1 + k]);
    }
    if (traits.constant_emission) {
      traits.emission = sum;
      if (is_black(sum)) traits.emits = traits.constant_emission = false;
    }
  }
  const bool estimate = traits.emits && !traits.constant_emission;
  auto program = std::make_shared<Program>(std::move(program_));
  if (!estimate) return program;

  // Mean emission over a spread of directions, coordinates and sides, with textures at their mean
  Color sum(0.0f);
  constexpr int k_samples = 256;
  for (int i = 0; i < k_samples; ++i) {
    const auto random = [&](uint32_t dimension) { return unit_float(hash_combine(hash_u32(i), dimension)); };
    ShadingPoint point;
    const float z = 1.0f - 2.0f * random(0), r = safe_sqrt(1.0f - z * z), phi = 2.0f * k_pi * random(1);
    point.wi_world = {r * std::cos(phi), r * std::sin(phi), z};
    const Vec3 n = z >= 0.0f ? Vec3(0, 0, 1) : Vec3(0, 0, -1);
    point.ng_world = point.ns_world = n;
    point.backfacing = z < 0.0f;
    point.p_world = {random(2) * 2 - 1, random(3) * 2 - 1, random(4) * 2 - 1};
    point.ray_kind = i & 1 ? k_ray_diffuse : k_ray_camera;
    for (AttributeValue& attribute : point.attributes)
      attribute = AttributeValue::constant({random(5), random(6), random(7), 1.0f});
    const Color radiance = program->emission(point, nullptr);
    for (int k = 0; k < 3; ++k)
      if (std::isfinite(radiance[k])) sum[k] += std::clamp(radiance[k], 0.0f, 1e15f);
  }
  program->set_emission_estimate(sum * (1.0f / k_samples));
  return program;
}

// --- Entry points --------------------------------------------------------------------------------------------------

std::shared_ptr<const Program> compile_material(const ShaderGraph& graph, const std::string& material_name,
                                                const ImageResolver& images, Report& report) {
  return Compiler(graph, Subject::material, material_name, images, report).compile();
}
std::shared_ptr<const Program> compile_displacement(const ShaderGraph& graph, const std::string& material_name,
                                                    const ImageResolver& images, Report& report) {
  return Compiler(graph, Subject::material, material_name, images, report).compile_displacement();
}
std::shared_ptr<const Program> compile_world(const ShaderGraph& graph, const std::string& world_name,
                                             const ImageResolver& images, Report& report) {
  return Compiler(graph, Subject::world, world_name, images, report).compile();
}
std::shared_ptr<const Program> compile_light(const ShaderGraph& graph, const std::string& light_name,
                                             const ImageResolver& images, Report& report) {
  if (graph.surface) return Compiler(graph, Subject::light, light_name, images, report).compile();
  ShaderGraph white;
  GraphNode emission;
  emission.name = emission.type = "Emission";
  emission.inputs["Color"] = GraphNumbers{1, 1, 1, 1};
  emission.inputs["Strength"] = 1.0f;
  white.nodes.push_back(std::move(emission));
  white.surface = GraphLink{0, "Emission"};
  return Compiler(white, Subject::light, light_name, images, report).compile();
}

std::shared_ptr<const Program> default_material() {
  ShaderGraph graph;
  GraphNode diffuse;
  diffuse.name = diffuse.type = "BsdfDiffuse";
  graph.nodes.push_back(std::move(diffuse));
  graph.surface = GraphLink{0, "BSDF"};
  Report report;
  const ImageResolver images;
  return Compiler(graph, Subject::material, "default", images, report).compile();
}

std::vector<std::string> supported_node_types() {
  std::vector<std::string> types = closure_node_types();
  types.push_back("MixShader");
  types.push_back("AddShader");
  for (const auto& [type, definition] : value_nodes())
    if (!value_stand_ins().contains(type)) types.push_back(type);
  std::sort(types.begin(), types.end());
  return types;
}

}  // namespace lambent
