// Meshes for tests and benchmarks.
#pragma once

#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "engine/geometry/geometry.h"

namespace lambent {

struct Shape {
  std::vector<float> positions;
  std::vector<uint32_t> triangles;

  uint32_t add(const Vec3& p) {
    positions.insert(positions.end(), {p.x, p.y, p.z});
    return static_cast<uint32_t>(positions.size() / 3 - 1);
  }
  Shape transformed(const Transform& t) const {
    Shape result = *this;
    for (size_t i = 0; i < positions.size(); i += 3) {
      const Vec3 p = t.point({positions[i], positions[i + 1], positions[i + 2]});
      for (int k = 0; k < 3; ++k) result.positions[i + static_cast<size_t>(k)] = p[k];
    }
    return result;
  }
};

/// Closed box [-1, 1]³ with outward winding.
inline Shape box_shape() {
  Shape shape;
  for (int i = 0; i < 8; ++i) shape.add({i & 1 ? 1.0f : -1.0f, i & 2 ? 1.0f : -1.0f, i & 4 ? 1.0f : -1.0f});
  shape.triangles = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                     2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
  return shape;
}

/// Closed unit sphere of 20·4^levels triangles, outward winding.
inline Shape icosphere_shape(int levels) {
  Shape shape;
  const float g = (1.0f + std::sqrt(5.0f)) / 2.0f;
  for (const Vec3& p :
       {Vec3(-1, g, 0), Vec3(1, g, 0), Vec3(-1, -g, 0), Vec3(1, -g, 0), Vec3(0, -1, g), Vec3(0, 1, g), Vec3(0, -1, -g),
        Vec3(0, 1, -g), Vec3(g, 0, -1), Vec3(g, 0, 1), Vec3(-g, 0, -1), Vec3(-g, 0, 1)})
    shape.add(normalize(p));
  shape.triangles = {0, 11, 5,  0, 5,  1, 0, 1, 7, 0, 7,  10, 0, 10, 11, 1, 5, 9, 5, 11,
                     4, 11, 10, 2, 10, 7, 6, 7, 1, 8, 3,  9,  4, 3,  4,  2, 3, 2, 6, 3,
                     6, 8,  3,  8, 9,  4, 9, 5, 2, 4, 11, 6,  2, 10, 8,  6, 7, 9, 8, 1};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> middles;
    const auto middle = [&](uint32_t a, uint32_t b) {
      const auto [entry, is_new] = middles.try_emplace(std::minmax(a, b), 0);
      if (is_new) {
        const auto vertex = [&](uint32_t i) {
          return Vec3(shape.positions[3 * i], shape.positions[3 * i + 1], shape.positions[3 * i + 2]);
        };
        entry->second = shape.add(normalize(vertex(a) + vertex(b)));
      }
      return entry->second;
    };
    std::vector<uint32_t> finer;
    for (size_t t = 0; t < shape.triangles.size(); t += 3) {
      const uint32_t a = shape.triangles[t], b = shape.triangles[t + 1], c = shape.triangles[t + 2];
      const uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {a, ab, ca, b, bc, ab, c, ca, bc, ab, bc, ca});
    }
    shape.triangles = std::move(finer);
  }
  return shape;
}

/// Bumpy sheet of 2·n² triangles over [-1, 1]².
inline Shape sheet_shape(uint32_t n) {
  Shape shape;
  for (uint32_t y = 0; y <= n; ++y)
    for (uint32_t x = 0; x <= n; ++x) {
      const float u = float(x) / float(n) * 2.0f - 1.0f, v = float(y) / float(n) * 2.0f - 1.0f;
      shape.add({u, v, 0.1f * std::sin(13.0f * u) * std::cos(11.0f * v)});
    }
  for (uint32_t y = 0; y < n; ++y)
    for (uint32_t x = 0; x < n; ++x) {
      const uint32_t a = y * (n + 1) + x, b = a + 1, c = a + n + 1, d = c + 1;
      shape.triangles.insert(shape.triangles.end(), {a, b, c, b, d, c});
    }
  return shape;
}

inline MeshInput mesh_input(const Shape& shape, const std::string& name = "mesh") {
  MeshInput input;
  input.name = name;
  input.positions = SharedSpan<float>(shape.positions);
  input.triangles = SharedSpan<uint32_t>(shape.triangles);
  return input;
}

inline std::shared_ptr<const TriangleMesh> make_mesh(const Shape& shape, const std::string& name = "mesh") {
  Report report;
  return TriangleMesh::create(mesh_input(shape, name), report);
}

inline GeometryObject make_object(std::shared_ptr<const TriangleMesh> mesh, std::vector<Transform> transforms = {{}}) {
  GeometryObject object;
  object.name = "object";
  object.mesh = std::move(mesh);
  object.world_from_object = std::move(transforms);
  return object;
}

/// Rotation by `angle_rad` around `axis` (Rodrigues).
inline Transform rotation(const Vec3& axis, float angle_rad) {
  const Vec3 a = normalize(axis);
  const float c = std::cos(angle_rad), s = std::sin(angle_rad);
  Transform t;
  for (int j = 0; j < 3; ++j) {
    Vec3 e(0.0f);
    e[j] = 1.0f;
    const Vec3 column = e * c + cross(a, e) * s + a * (dot(a, e) * (1.0f - c));
    for (int i = 0; i < 3; ++i) t.m[i][j] = column[i];
  }
  return t;
}

/// Uniform in [0, 1) from a fixed seed.
class TestRandom {
 public:
  explicit TestRandom(uint64_t seed = 1) : state_(seed) {}
  float operator()() {
    state_ = state_ * 6364136223846793005ull + 1442695040888963407ull;
    return static_cast<float>(state_ >> 40) * 0x1p-24f;
  }
  Vec3 direction() {
    const float z = 2.0f * (*this)() - 1.0f, phi = 2.0f * k_pi * (*this)(), r = safe_sqrt(1.0f - z * z);
    return {r * std::cos(phi), r * std::sin(phi), z};
  }

 private:
  uint64_t state_;
};

}  // namespace lambent
