// Description values to the inputs of the modules below: field by field, no decisions except units.
#pragma once

#include <memory>
#include <vector>

#include "engine/assets/texture_system.h"
#include "engine/base/report.h"
#include "engine/camera/camera.h"
#include "engine/description/description.h"
#include "engine/geometry/triangle_mesh.h"
#include "engine/shading/graph.h"

namespace lambent {

ShaderGraph shader_graph(const description::Graph& graph);
MeshInput mesh_input(const description::Mesh& mesh);
ImageSource image_source(const std::shared_ptr<const description::Image>& image);
/// `origin_shift` is subtracted from the camera's position.
CameraSpec camera_spec(const description::Camera& camera, const description::Settings& settings,
                       const Vec3d& origin_shift);
/// RayKind bits.
uint32_t visibility_mask(const description::Visibility& visibility);
/// Transforms f32[N][3][4] as given (null: none), each with `origin_shift` subtracted in double.
std::vector<Transform> instance_transforms(const ArrayPointer& given, const Vec3d& origin_shift);

}  // namespace lambent
