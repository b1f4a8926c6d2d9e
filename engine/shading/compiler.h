// From a shader graph to expressions and closures. Nodes of values are defined in compile_values.cpp, closures in
// compile_closures.cpp; compiler.cpp walks the graph and assembles the program.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "engine/shading/expressions.h"
#include "engine/shading/graph.h"

namespace lambent {

enum class SocketKind : uint8_t { number, color, vector };

/// A value with what it stands for: implicit conversions depend on it.
struct TypedValue {
  Value value;
  SocketKind kind = SocketKind::number;
};

class Compiler;
/// Value of one output socket of a node. @param shift 0 at the point, 1 or 2 one footprint further (bump).
using ValueNode = TypedValue (*)(Compiler& compiler, int node, const std::string& socket, int shift);
/// Node type to its definition.
const std::map<std::string, ValueNode>& value_nodes();
/// Those of them that only stand in for what the node does, and say so.
const std::map<std::string, ValueNode>& value_stand_ins();

/// What is compiled: it decides what unconnected inputs and the closures mean.
enum class Subject : uint8_t { material, world, light };

class Compiler {
 public:
  Compiler(const ShaderGraph& graph, Subject subject, const std::string& name, const ImageResolver& images,
           Report& report);

  std::shared_ptr<const Program> compile();
  /// What moves vertices; null if nothing does.
  std::shared_ptr<const Program> compile_displacement();

  // --- For the definitions of nodes ---------------------------------------------------------------------------------
  const GraphNode& node(int index) const { return graph_.nodes[index]; }
  Expressions& expressions() { return expressions_; }
  ProgramData& program() { return *program_; }
  bool is_world() const { return subject_ == Subject::world; }
  /// Only meshes have attributes.
  bool on_mesh() const { return subject_ == Subject::material; }

  /// The input's link, value, or `otherwise`.
  Value number(int node, const char* socket, float otherwise, int shift);
  Value color(int node, const char* socket, const Color& otherwise, int shift);
  Value vector(int node, const char* socket, const Vec3& otherwise, int shift);
  /// The input's link, or what Blender uses for an unconnected input of the kind.
  Value vector_or(int node, const char* socket, int shift, Value (Compiler::*otherwise)(int shift));
  bool is_linked(int node, const char* socket) const;
  bool has_input(int node, const char* socket) const;
  /// Text that an input has; null if it has none.
  const std::string* input_text(int node, const char* socket) const;
  /// True if output `socket` of the node is read by another node.
  bool output_used(int node, const char* socket) const;

  std::string text(int node, const char* property, const char* otherwise) const;
  float property(int node, const char* property, float otherwise) const;
  bool flag(int node, const char* property, bool otherwise) const;
  /// Index in `names` of a property's text; reports an unknown one and returns 0.
  int choice(int node, const char* property, const std::vector<const char*>& names);

  /// Cycles' rules of that version (ShaderGraph::cycles_version) hold.
  bool follows(int version) const { return graph_.cycles_version >= version; }
  /// Slopes are taken over this many pixels; a program with several has the least of them.
  void filter_bumps(float width_px);
  Value attribute(AttributeRequest::Kind kind, const std::string& name, int shift);
  // What unconnected inputs stand for
  Value uv(int shift);
  Value generated(int shift);
  Value position(int shift);
  Value object_position(int shift);
  Value normal(int shift);
  /// The material moves vertices.
  bool displaces() const {
    return subject_ == Subject::material && graph_.displacement &&
           graph_.displacement_method != DisplacementMethod::bump;
  }
  /// A displacement turns the default normal, so that closures need it as an operand.
  bool has_bumped_normal() const { return bumped_normal_.expression >= 0; }
  Value object_normal(int shift);
  Value tangent(int shift);
  uint32_t texture(int node, ImageProjection projection);

  /// A colour that an operation computes in linear Rec. 709, in the scene's space; variant 1 of the operation gives
  /// what Rec. 709 cannot show.
  Value computed_color(Op op, const std::vector<Value>& arguments, uint32_t data = 0);

  TypedValue output(const GraphLink& link, int shift);
  Value to_number(const TypedValue& value);
  Value to_vector(const TypedValue& value);
  void warn_unsupported(int node, const std::string& what);

  /// Adds the closures of a shader socket, each with its weight.
  void add_closures(const GraphLink& link, const Value& weight);
  /// @param normals: at most three, in the order normal, coat normal, tangent
  void add_closure(ClosureUse use, const Value& weight, const std::vector<Value>& normals,
                   const std::vector<Value>& parameters);

 private:
  /// Adds what an AOV output node shows.
  void add_aov(int node);
  void generate_aovs();
  /// Makes the displacement the default normal's bump.
  void add_bump();
  const GraphValue* find_input(int node, const char* socket) const;
  /// x, or `otherwise` with a message if x is NaN or infinite.
  float finite(int node, const char* socket, float x, float otherwise);
  std::shared_ptr<const Program> finish();
  std::string subject_text(int node) const;

  struct MemoKey {
    int node;
    std::string socket;
    int shift;
    auto operator<=>(const MemoKey&) const = default;
  };

  bool bump_is_filtered_ = false;
  bool undisplaced_ = false;  ///< positions are those before displacement
  const ShaderGraph& graph_;
  Subject subject_;
  std::string name_;
  const ImageResolver& images_;
  Report& report_;
  std::unique_ptr<ProgramData> program_ = std::make_unique<ProgramData>();
  Expressions expressions_;
  std::map<MemoKey, TypedValue> memo_;
  std::vector<int> path_;  ///< nodes being visited, to find loops
  std::set<std::pair<int, std::string>> reported_;
  std::map<std::string, uint32_t> texture_indices_;
  std::vector<Expressions::Closure> surface_, transparency_, emission_;
  std::vector<Expressions::Closure> aovs_;  ///< two each: color, number
  Value bumped_normal_;                     ///< of a displacement used as bump; expression < 0: none
};

/// Definitions of closure nodes. False if the type is not a closure.
bool compile_closure_node(Compiler& compiler, int node, const Value& weight);
/// Types that compile_closure_node knows, without those it replaces by stand-ins.
std::vector<std::string> closure_node_types();

}  // namespace lambent
