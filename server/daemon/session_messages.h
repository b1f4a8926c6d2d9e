// Messages that carry a render's results, encoded from the engine's types (PROTOCOL.md, "Daemon -> client").
#pragma once

#include "engine/description/json_text.h"
#include "engine/session/session.h"
#include "server/transport/connection.h"

namespace lambent {

/// A frame from its JSON header alone.
OutgoingMessage message_of(const Json& header);
/// A `tile` frame; takes the pixels over.
OutgoingMessage tile_message(TileSnapshot tile);
OutgoingMessage progress_message(const Progress& progress);
OutgoingMessage render_done_message(const RenderOutcome& outcome);

}  // namespace lambent
