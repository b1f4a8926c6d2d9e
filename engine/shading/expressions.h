// The compiler's intermediate form: values in a table, equal ones shared, constant ones computed at once.
#pragma once

#include <map>
#include <vector>

#include "engine/shading/program_data.h"

namespace lambent {

/// A value: an expression's result, or some of its consecutive floats.
struct Value {
  int expression = -1;
  int offset = 0;
  int width = 1;  ///< floats
  friend bool operator==(const Value&, const Value&) = default;
};

/// Values of a program under construction.
class Expressions {
 public:
  explicit Expressions(ProgramData& program) : program_(program) {}

  Value number(float x);
  Value vector(const Vec3& v);
  Value vector4(const Vec4& v);
  /// Result of an operation, `width` floats wide. Operations on constants that read nothing of the point are computed
  /// here; an operation that exists already is shared.
  Value operation(Op op, int variant, std::vector<Value> arguments, int width, uint32_t data = 0);
  /// Floats [offset, offset + width) of a value.
  Value part(const Value& value, int offset, int width) const {
    return {value.expression, value.offset + offset, width};
  }

  /// The argument of which a value is the whole result of an operation with one; the value itself if it is not.
  Value argument_of(const Value& value, Op op, int variant) const {
    const Node& node = nodes_[value.expression];
    const bool is_result = !node.constant && node.op == op && node.variant == variant && value.offset == 0 &&
                           value.width == node.width && node.arguments.size() == 1;
    return is_result ? node.arguments[0] : value;
  }

  bool is_constant(const Value& value) const { return nodes_[value.expression].constant; }
  /// Of a constant value.
  const float* constant(const Value& value) const { return nodes_[value.expression].values.data() + value.offset; }
  bool is_number(const Value& value, float x) const { return is_constant(value) && *constant(value) == x; }

  /// A closure to emit: its weight, normals and parameters as values.
  struct Closure {
    uint32_t index;  ///< in ProgramData::closures
    std::vector<Value> operands;
  };
  /// Orders what the closures need and nothing else, and assigns registers, reusing those whose value is not needed
  /// any more. False if more than k_max_registers are needed at once.
  bool generate(const std::vector<Closure>& closures, Code& code);

  /// True if an operation for which `of_kind` holds is among those that the values are computed from.
  bool depends_on(const std::vector<Value>& values, bool (*of_kind)(Op op)) const;
  /// True if no float of the value can be negative, as far as its operations tell.
  bool never_negative(const Value& value) const;

  /// How many operations were written, for tests.
  size_t size() const { return nodes_.size(); }

 private:
  struct Node {
    Op op = Op::math;
    uint8_t variant = 0;
    uint32_t data = 0;
    int width = 1;
    bool constant = false;
    std::vector<Value> arguments;
    std::vector<float> values;  ///< if constant
  };
  Value constant_value(std::vector<float> values);
  Operand constant_operand(const Value& value);

  ProgramData& program_;
  std::vector<Node> nodes_;
  std::map<std::vector<int64_t>, int> known_;  ///< by operation and arguments
  std::map<std::vector<float>, int> known_constants_;
  std::map<std::vector<float>, uint32_t> stored_constants_;
};

}  // namespace lambent
