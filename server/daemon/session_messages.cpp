#include "server/daemon/session_messages.h"

#include "engine/base/memory.h"
#include "engine/description/frame.h"

namespace lambent {
namespace {

Json rectangle_json(const Rectangle& rectangle) {
  return Json::array({rectangle.x, rectangle.y, rectangle.width, rectangle.height});
}

const char* stage_name(Stage stage) {
  switch (stage) {
    case Stage::idle:
    case Stage::updating:
      return "updating";
    case Stage::building:
      return "building";
    case Stage::rendering:
      return "rendering";
  }
  return "";
}

const char* status_name(RenderStatus status) {
  switch (status) {
    case RenderStatus::finished:
      return "finished";
    case RenderStatus::cancelled:
      return "cancelled";
    case RenderStatus::failed:
      return "failed";
  }
  return "";
}

Json statistics_json(const Statistics& statistics) {
  const MemoryUse& memory = statistics.memory;
  return {{"update_s", statistics.update_s},
          {"build_s", statistics.build_s},
          {"render_s", statistics.render_s},
          {"first_tile_s", statistics.first_tile_s},
          {"rays", statistics.rays},
          {"paths", statistics.paths},
          {"non_finite", statistics.non_finite},
          {"triangles", statistics.triangles},
          {"unique_triangles", statistics.unique_triangles},
          {"instances", statistics.instances},
          {"emitters", statistics.emitters},
          {"profile", statistics.profile},
          {"modelled", statistics.modelled},
          {"not_modelled", statistics.not_modelled},
          {"memory",
           {{"geometry", memory.geometry},
            {"bvh", memory.bvh},
            {"textures", memory.textures},
            {"film", memory.film},
            {"lights", memory.lights},
            {"shading", memory.shading}}}};
}

}  // namespace

OutgoingMessage message_of(const Json& header) { return {encode_frame_start(header), nullptr, {}}; }

OutgoingMessage tile_message(TileSnapshot tile) {
  Json channels = Json::array();
  for (const Channel& channel : tile.channels)
    channels.push_back({{"name", channel.name}, {"components", channel.components}});
  const Json header{{"type", "tile"},          {"epoch", tile.epoch}, {"rect", rectangle_json(tile.rectangle)},
                    {"samples", tile.samples}, {"final", tile.final}, {"channels", std::move(channels)}};
  const auto pixels = std::make_shared<const std::vector<float>>(std::move(tile.pixels));
  return {encode_frame_start(header, pixels->size() * sizeof(float)), pixels, std::as_bytes(std::span(*pixels))};
}

OutgoingMessage progress_message(const Progress& progress) {
  Json active = Json::array();
  for (const Rectangle& rectangle : progress.active_tiles) active.push_back(rectangle_json(rectangle));
  return message_of({{"type", "progress"},
                     {"epoch", progress.epoch},
                     {"stage", stage_name(progress.stage)},
                     {"samples", progress.samples},
                     {"samples_total", progress.samples_total},
                     {"tiles", progress.tiles},
                     {"tiles_total", progress.tiles_total},
                     {"elapsed_s", progress.elapsed_s},
                     {"remaining_s", progress.remaining_s ? Json(*progress.remaining_s) : Json()},
                     {"memory_bytes", resident_bytes()},
                     {"memory_peak_bytes", peak_resident_bytes()},
                     {"active_tiles", std::move(active)}});
}

OutgoingMessage render_done_message(const RenderOutcome& outcome, bool tiles_waiting) {
  Json header = {{"type", "render_done"},
                 {"epoch", outcome.epoch},
                 {"status", status_name(outcome.status)},
                 {"samples", outcome.samples},
                 {"statistics", statistics_json(outcome.statistics)},
                 {"message", outcome.message}};
  if (tiles_waiting) header["tiles_waiting"] = true;
  return message_of(header);
}

}  // namespace lambent
