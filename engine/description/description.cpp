#include "engine/description/description.h"

#include <type_traits>

namespace lambent::description {
namespace {

template <typename T>
Table<T>& table_of(SceneDescription& scene) {
  if constexpr (std::is_same_v<T, Mesh>) return scene.meshes;
  if constexpr (std::is_same_v<T, Image>) return scene.images;
  if constexpr (std::is_same_v<T, Material>) return scene.materials;
  if constexpr (std::is_same_v<T, Light>) return scene.lights;
  if constexpr (std::is_same_v<T, Object>) return scene.objects;
  if constexpr (std::is_same_v<T, Camera>) return scene.cameras;
  if constexpr (std::is_same_v<T, World>) return scene.worlds;
}

void apply(Upsert& upsert, SceneDescription& scene) {
  std::visit(
      [&]<typename T>(T& value) {
        if constexpr (std::is_same_v<T, Settings>)
          scene.settings = std::make_shared<const Settings>(std::move(value));
        else
          table_of<T>(scene).insert_or_assign(std::move(upsert.id), std::make_shared<const T>(std::move(value)));
      },
      upsert.value);
}

void apply(const Remove& remove, SceneDescription& scene) {
  switch (remove.kind) {
    case Kind::mesh:
      scene.meshes.erase(remove.id);
      break;
    case Kind::image:
      scene.images.erase(remove.id);
      break;
    case Kind::material:
      scene.materials.erase(remove.id);
      break;
    case Kind::light:
      scene.lights.erase(remove.id);
      break;
    case Kind::object:
      scene.objects.erase(remove.id);
      break;
    case Kind::camera:
      scene.cameras.erase(remove.id);
      break;
    case Kind::world:
      scene.worlds.erase(remove.id);
      break;
    case Kind::settings:
      scene.settings = std::make_shared<const Settings>();
      break;
  }
}

void apply(const Clear&, SceneDescription& scene) { scene = SceneDescription{}; }

}  // namespace

void apply(Transaction transaction, SceneDescription& scene) {
  for (Edit& edit : transaction.edits) std::visit([&](auto& one) { apply(one, scene); }, edit);
}

}  // namespace lambent::description
