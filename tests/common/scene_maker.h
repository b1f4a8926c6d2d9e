// Small scenes made in code, rendered through the same Session that the daemon and the command line use.
#pragma once

#include <string>
#include <vector>

#include "engine/session/session.h"

namespace lambent::test {

/// A scene under construction. Every add function returns *this.
class SceneMaker {
 public:
  /// A frame of width x height pixels, a perspective camera at the origin that looks along -Z, `samples` samples, box
  /// filter.
  SceneMaker(int width, int height, int64_t samples);

  description::Settings settings;
  description::Camera camera;

  SceneMaker& material(const std::string& id, description::Graph graph);
  /// Triangles (indices into positions), flat, one material; transforms of its instances (none: one identity).
  SceneMaker& mesh(const std::string& id, const std::vector<Vec3>& positions,
                   const std::vector<std::array<uint32_t, 3>>& triangles, const std::string& material,
                   const std::vector<Transform>& transforms = {});
  /// A sphere of `rings` latitude rings whose vertices lie on the sphere, normals outwards; flat unless `smooth`.
  SceneMaker& sphere(const std::string& id, const Vec3& center, float radius, int rings, const std::string& material,
                     bool smooth = false);
  /// Another mesh in place of what mesh or sphere added under that id.
  SceneMaker& replace_mesh(const std::string& id, description::Mesh mesh);
  SceneMaker& light(const std::string& id, description::Light light, const Transform& world_from_light);
  SceneMaker& world(description::Graph graph);
  SceneMaker& object(const std::string& id, description::Object object);
  /// What mesh, sphere or light added under that id, to be changed.
  description::Object& object(const std::string& id);
  /// Scales and then moves everything added so far, camera and lamp sizes and powers included, so that the picture
  /// should not change.
  SceneMaker& scale_and_move(float scale, const Vec3& offset);

  description::Transaction transaction(int64_t epoch = 1) const;
  const description::SceneDescription& description() const { return scene_; }

 private:
  description::SceneDescription scene_;
};

/// Graphs of one or two nodes.
description::Graph diffuse(const Color& color, float roughness = 0.0f);
description::Graph emission(const Color& color, float strength);
description::Graph diffuse_emitter(const Color& albedo, const Color& emitted);
description::Graph background(const Color& color);
description::Graph transparent(const Color& color);
description::Graph single(const std::string& type, std::map<std::string, description::SocketValue> inputs,
                          std::map<std::string, description::SocketValue> properties = {});

/// A room corner with a lamp, an emissive sheet, a sphere of glass and a mirror: something of everything, in 48 x 40
/// pixels.
SceneMaker room(int64_t samples);

/// At `position`, the local -Z axis towards `target`: how lamps and cameras look.
Transform aimed(const Vec3& position, const Vec3& target);

/// Renders on `threads` threads and returns the picture; fails the test if the render does not finish.
Picture render(const description::Transaction& transaction, int threads = 0, RenderOutcome* outcome = nullptr,
               Report* report = nullptr);
/// The picture of a render that was stopped once it had `samples` samples, saved as a checkpoint and continued by
/// another session; fails the test if it was done before it could be stopped.
Picture render_interrupted(const SceneMaker& maker, int64_t samples);
/// Mean of the first three channels over the picture, and the standard error of that mean from the pixels' spread.
struct Mean {
  Color value{0.0f};
  double standard_error = 0.0;  ///< of the mean of the three channels' average
};
Mean mean(const Picture& picture);

}  // namespace lambent::test
