// Scalar and vector arithmetic of the Math and Vector Math nodes, total: no input gives a trap, and what Blender
// defines for division by zero and the like is kept.
#pragma once

#include "engine/shading/color_math.h"
#include "engine/shading/program_data.h"

namespace lambent {

float math_operation(MathOperation operation, float a, float b, float c);
/// For the operations with a vector result. @param scale of Scale, IOR of Refract.
Vec3 vector_operation(VectorOperation operation, const Vec3& a, const Vec3& b, const Vec3& c, float scale);
/// For dot, distance and length.
float vector_operation_float(VectorOperation operation, const Vec3& a, const Vec3& b);

/// v rotated around a unit axis, right-handed.
Vec3 rotate_around_axis(const Vec3& v, const Vec3& axis, float angle_rad);
/// Rotation matrix of XYZ Euler angles as rows.
void euler_rows(const Vec3& euler_rad, Vec3 rows[3]);

}  // namespace lambent
