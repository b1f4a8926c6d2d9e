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
/// `tiles_waiting`: final tiles of it are still to come, as soon as the client grants credit.
OutgoingMessage render_done_message(const RenderOutcome& outcome, bool tiles_waiting = false);

}  // namespace lambent
