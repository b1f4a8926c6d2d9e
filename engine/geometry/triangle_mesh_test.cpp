#include "engine/geometry/triangle_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mman.h>

#include <cstring>

#include "engine/geometry/shapes_for_tests.h"

namespace lambent {
namespace {

using testing::HasSubstr;

/// Two triangles of the unit square, corner-domain UVs equal to x and y.
MeshInput square() {
  MeshInput input;
  input.name = "Square";
  input.positions = SharedSpan<float>(std::vector<float>{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0});
  input.triangles = SharedSpan<uint32_t>(std::vector<uint32_t>{0, 1, 2, 0, 2, 3});
  MeshAttribute uv;
  uv.name = "UVMap";
  uv.role = AttributeRole::uv;
  uv.components = 2;
  uv.values = SharedSpan<float>(std::vector<float>{0, 0, 1, 0, 1, 1, 0, 0, 1, 1, 0, 1});
  input.attributes.push_back(uv);
  return input;
}

TEST(TriangleMesh, shares_valid_arrays_without_copying) {
  Report report;
  const MeshInput input = square();
  const auto mesh = TriangleMesh::create(input, report);
  EXPECT_EQ(mesh->positions(), input.positions.values.data());
  EXPECT_EQ(mesh->indices(), input.triangles.values.data());
  EXPECT_TRUE(report.messages().empty());
}

TEST(TriangleMesh, keeps_shared_memory_alive) {
  auto owner = std::make_shared<std::vector<float>>(9, 1.0f);
  const std::weak_ptr<std::vector<float>> watch = owner;
  MeshInput input;
  input.positions = SharedSpan<float>(*owner, owner);
  input.triangles = SharedSpan<uint32_t>(std::vector<uint32_t>{0, 1, 2});
  Report report;
  auto mesh = TriangleMesh::create(std::move(input), report);
  owner.reset();
  EXPECT_FALSE(watch.expired());
  mesh.reset();
  EXPECT_TRUE(watch.expired());
}

TEST(TriangleMesh, positions_that_end_with_their_memory_page_can_be_traced) {
  const size_t page = 4096;
  auto* memory =
      static_cast<std::byte*>(mmap(nullptr, 2 * page, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0));
  ASSERT_NE(memory, MAP_FAILED);
  ASSERT_EQ(mprotect(memory + page, page, PROT_NONE), 0);
  const float corners[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  auto* positions = reinterpret_cast<float*>(memory + page - sizeof corners);
  std::memcpy(positions, corners, sizeof corners);
  MeshInput input;
  input.positions = SharedSpan<float>(std::span<const float>(positions, 9), nullptr);
  input.triangles = SharedSpan<uint32_t>(std::vector<uint32_t>{0, 1, 2});
  Report report;
  const auto mesh = TriangleMesh::create(std::move(input), report);
  GeometryBuilder builder;
  const auto geometry = builder.build({make_object(mesh)}, {}, CancelFlag(), report);
  ASSERT_TRUE(geometry);
  Ray ray;
  ray.origin = {0.2f, 0.2f, 1};
  ray.direction = {0, 0, -1};
  EXPECT_TRUE((*geometry)->occluded(ray));
  munmap(memory, 2 * page);
}

TEST(TriangleMesh, leaves_out_triangles_with_indices_out_of_range_and_names_the_mesh) {
  MeshInput input = square();
  input.triangles = SharedSpan<uint32_t>(std::vector<uint32_t>{0, 1, 4, 0, 2, 3});
  input.triangle_materials = SharedSpan<uint16_t>(std::vector<uint16_t>{7, 2});
  Report report;
  const auto mesh = TriangleMesh::create(std::move(input), report);
  ASSERT_EQ(mesh->triangle_count(), 1u);
  EXPECT_EQ(mesh->dropped_triangles(), 1u);
  EXPECT_EQ(mesh->vertices(0), (std::array<uint32_t, 3>{0, 2, 3}));
  EXPECT_EQ(mesh->corners(0), (std::array<uint32_t, 3>{3, 4, 5}));  // as before
  EXPECT_EQ(mesh->face(0), 1u);
  EXPECT_EQ(mesh->material_slot(0), 2u);
  EXPECT_EQ(mesh->max_material_slot(), 2u);
  ASSERT_EQ(report.messages().size(), 1u);
  EXPECT_THAT(report.messages()[0].text, HasSubstr("Mesh 'Square': 1 of 2 triangles"));
  EXPECT_EQ(report.messages()[0].severity, Severity::warning);
}

TEST(TriangleMesh, leaves_out_triangles_with_unusable_vertices) {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), k_infinity, -k_infinity, 3e38f}) {
    MeshInput input = square();
    std::vector<float> positions(input.positions.values.begin(), input.positions.values.end());
    positions[3] = bad;  // vertex 1, of the first triangle only
    input.positions = SharedSpan<float>(std::move(positions));
    Report report;
    const auto mesh = TriangleMesh::create(std::move(input), report);
    EXPECT_EQ(mesh->triangle_count(), 1u) << bad;
    EXPECT_TRUE(is_finite(mesh->bounds_object().min) && is_finite(mesh->bounds_object().max));
    ASSERT_EQ(report.messages().size(), 1u);
    EXPECT_THAT(report.messages()[0].text, HasSubstr("NaN, infinite"));
  }
}

TEST(TriangleMesh, zero_area_triangles_stay_and_are_known_as_such) {
  MeshInput input = square();
  input.triangles = SharedSpan<uint32_t>(std::vector<uint32_t>{0, 1, 1, 0, 2, 3});
  Report report;
  const auto mesh = TriangleMesh::create(std::move(input), report);
  ASSERT_EQ(mesh->triangle_count(), 2u);
  EXPECT_TRUE(mesh->is_degenerate(0));
  EXPECT_FALSE(mesh->is_degenerate(1));
  EXPECT_EQ(mesh->geometric_normal(0), Vec3(0.0f));
  ASSERT_EQ(report.messages().size(), 1u);
  EXPECT_EQ(report.messages()[0].code, "degenerate_triangles");
}

TEST(TriangleMesh, tiny_and_huge_triangles_keep_their_area_and_normal) {
  for (const float scale : {1e-15f, 1e-6f, 1.0f, 1e6f, 1e15f}) {
    Shape shape;
    shape.add(Vec3(0, 0, 0) * scale);
    shape.add(Vec3(3, 0, 0) * scale);
    shape.add(Vec3(0, 0, 2) * scale);
    shape.triangles = {0, 1, 2};
    const auto mesh = make_mesh(shape);
    EXPECT_NEAR(mesh->area(0) / (double(scale) * scale), 3.0, 1e-5) << scale;
    EXPECT_EQ(mesh->geometric_normal(0), Vec3(0, -1, 0)) << scale;
  }
}

TEST(TriangleMesh, empty_input_gives_an_empty_mesh_and_malformed_input_a_message_as_well) {
  Report report;
  EXPECT_TRUE(TriangleMesh::create({}, report)->empty());
  EXPECT_TRUE(report.messages().empty());
  MeshInput odd = square();
  odd.triangles = SharedSpan<uint32_t>(std::vector<uint32_t>{0, 1});
  EXPECT_TRUE(TriangleMesh::create(std::move(odd), report)->empty());
  EXPECT_EQ(report.messages().size(), 1u);
}

TEST(TriangleMesh, attributes_and_normals_with_too_few_values_are_left_out_by_name) {
  MeshInput input = square();
  input.attributes[0].values = SharedSpan<float>(std::vector<float>(10));
  input.normals = SharedSpan<float>(std::vector<float>(9));
  input.normals_domain = AttributeDomain::vertex;
  input.triangle_materials = SharedSpan<uint16_t>(std::vector<uint16_t>{1});
  Report report;
  const auto mesh = TriangleMesh::create(std::move(input), report);
  EXPECT_EQ(mesh->find_uv(""), -1);
  EXPECT_FALSE(mesh->has_normals());
  EXPECT_EQ(mesh->material_slot(0), 0u);
  ASSERT_EQ(report.messages().size(), 3u);
  EXPECT_THAT(report.messages()[2].text, HasSubstr("'UVMap'"));
}

TEST(TriangleMesh, attributes_interpolate_by_domain) {
  MeshInput input = square();
  MeshAttribute face{"face", AttributeDomain::face, AttributeRole::generic, 1,
                     SharedSpan<float>(std::vector<float>{5, 6})};
  MeshAttribute vertex{"vertex", AttributeDomain::vertex, AttributeRole::color, 4,
                       SharedSpan<float>(std::vector<float>{0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0})};
  input.attributes.push_back(face);
  input.attributes.push_back(vertex);
  Report report;
  const auto mesh = TriangleMesh::create(std::move(input), report);
  const Vec2 b(0.25f, 0.5f);
  const Triangle p = mesh->triangle(1);
  const Vec3 position = p[0] * 0.25f + p[1] * 0.25f + p[2] * 0.5f;
  EXPECT_EQ(mesh->attribute(mesh->find_uv(""), 1, b), Vec4(position.x, position.y, 0, 1));
  EXPECT_EQ(mesh->attribute(mesh->find_attribute("face"), 1, b), Vec4(6, 6, 6, 1));
  EXPECT_EQ(mesh->attribute(mesh->find_color("vertex"), 0, b), Vec4(0.25f, 0.5f, 0, 0));
  EXPECT_EQ(mesh->find_color("UVMap"), -1);
  const auto gradient = mesh->attribute_gradient(mesh->find_uv("UVMap"), 0, b);
  EXPECT_EQ(gradient.du, Vec4(1, 0, 0, 0));
  EXPECT_EQ(gradient.dv, Vec4(1, 1, 0, 0));
}

TEST(TriangleMesh, active_uv_set_is_the_named_one) {
  MeshInput input = square();
  input.attributes.push_back(input.attributes[0]);
  input.attributes[1].name = "Second";
  input.active_uv = "Second";
  Report report;
  const auto mesh = TriangleMesh::create(std::move(input), report);
  EXPECT_EQ(mesh->find_uv(""), 1);
  EXPECT_EQ(mesh->find_uv("UVMap"), 0);
  EXPECT_EQ(mesh->find_uv("missing"), -1);
}

TEST(TriangleMesh, shading_normals_interpolate_and_fall_back_to_the_geometric_one) {
  MeshInput input = square();
  const float r = std::sqrt(0.5f);
  input.normals = SharedSpan<float>(std::vector<float>{0, 0, 1, r, 0, r, 0, 0, 0, 0, 0, 0});
  input.normals_domain = AttributeDomain::vertex;
  Report report;
  const auto mesh = TriangleMesh::create(std::move(input), report);
  const Vec3 expected = normalize(Vec3(r * 0.5f, 0, 0.5f + r * 0.5f));
  EXPECT_LT(length(mesh->shading_normal(0, {0.5f, 0}) - expected), 1e-6f);
  EXPECT_EQ(mesh->shading_normal(1, {0.5f, 0.5f}), Vec3(0, 0, 1));  // two zero normals
}

TEST(TriangleMesh, generated_coordinates_span_the_texture_space) {
  MeshInput input = square();
  input.texture_space_location = {0.5f, 0.5f, 0};
  input.texture_space_size = {0.5f, 0.5f, 0};
  Report report;
  const auto mesh = TriangleMesh::create(std::move(input), report);
  EXPECT_EQ(mesh->generated({0, 0, 0}), Vec3(0, 0, 0.5f));
  EXPECT_EQ(mesh->generated({1, 1, 0}), Vec3(1, 1, 0.5f));
}

TEST(TriangleMesh, tangents_follow_the_first_uv_coordinate_and_tell_mirrored_uvs) {
  Report report;
  const auto mesh = TriangleMesh::create(square(), report);
  EXPECT_EQ(mesh->tangent(0, 0, {0.2f, 0.3f}), Vec4(1, 0, 0, 1));
  MeshInput mirrored = square();
  mirrored.attributes[0].values = SharedSpan<float>(std::vector<float>{0, 0, -1, 0, -1, 1, 0, 0, -1, 1, 0, 1});
  EXPECT_EQ(TriangleMesh::create(std::move(mirrored), report)->tangent(0, 1, {0.2f, 0.3f}), Vec4(-1, 0, 0, -1));
}

TEST(TriangleMesh, tangents_are_orthogonal_to_smooth_normals_and_continuous_across_triangles) {
  // Sphere with longitude and latitude as UVs, by vertex.
  const Shape shape = icosphere_shape(4);
  MeshInput input = mesh_input(shape);
  input.normals = input.positions;
  input.normals_domain = AttributeDomain::vertex;
  std::vector<float> uv;
  for (size_t i = 0; i < shape.positions.size(); i += 3) {
    uv.push_back(std::atan2(shape.positions[i + 1], shape.positions[i]));
    uv.push_back(std::asin(shape.positions[i + 2]));
  }
  input.attributes.push_back(
      {"UVMap", AttributeDomain::vertex, AttributeRole::uv, 2, SharedSpan<float>(std::move(uv))});
  Report report;
  const auto mesh = TriangleMesh::create(std::move(input), report);
  for (uint32_t t = 0; t < mesh->triangle_count(); ++t) {
    const Vec3 p = mesh->vertex(mesh->vertices(t)[0]);
    // Away from the poles and from the seam, where longitude jumps.
    if (std::fabs(p.z) > 0.8f || p.x < 0.0f) continue;
    const Vec4 tangent = mesh->tangent(0, t, {0, 0});
    const Vec3 expected = normalize(Vec3(-p.y, p.x, 0));
    EXPECT_GT(dot(Vec3(tangent.x, tangent.y, tangent.z), expected), 0.995f) << t;
    EXPECT_NEAR(dot(Vec3(tangent.x, tangent.y, tangent.z), p), 0.0f, 1e-5f) << t;
    EXPECT_EQ(tangent.w, 1.0f);
  }
}

}  // namespace
}  // namespace lambent
