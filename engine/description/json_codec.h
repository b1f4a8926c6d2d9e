// The description's JSON (PROTOCOL.md, section "Edits"), in both directions. This is the only encoder and the only
// validator: the wire and saved scenes both pass here.
#pragma once

#include <atomic>
#include <functional>
#include <optional>
#include <string>
#include <unordered_set>
#include <vector>

#include "engine/base/report.h"
#include "engine/description/description.h"
#include "engine/description/json_text.h"

namespace lambent::description {

/// The array with that hash; null if there is none.
using ArrayResolver = std::function<ArrayPointer(const std::string& hash)>;

struct DecodeLimits {
  int64_t pixels = int64_t(1) << 28;             ///< width x height of the full frame
  const std::atomic<bool>* abandoned = nullptr;  ///< if set and true, decoding stops early with an error
};

/// The transaction in a message {"epoch", "edits"}. Checks types, ranges, counts, references to arrays and that numbers
/// are finite in 32 bits. Every problem is an error in `report` that names datablock and member; if there is one, the
/// result is empty. Unknown members are warnings. Null members count as absent. Never throws.
std::optional<Transaction> decode_transaction(const Json& message, const ArrayResolver& arrays, Report& report,
                                              const DecodeLimits& limits = {});

/// Arrays that encoded values name, each once, in order of first use.
class ArrayCollector {
 public:
  void add(const ArrayPointer& array) {
    if (seen_.insert(array->hash).second) arrays_.push_back(array);
  }
  const std::vector<ArrayPointer>& arrays() const { return arrays_; }

 private:
  std::unordered_set<std::string> seen_;
  std::vector<ArrayPointer> arrays_;
};

/// {"op", ...} as decode_transaction() reads it. Every member is written, defaults included.
Json encode_edit(const Edit& edit, ArrayCollector& arrays);
/// {"type": "transaction", "epoch", "edits"}.
Json encode_transaction(const Transaction& transaction, ArrayCollector& arrays);
/// The transaction that makes `scene` from nothing.
Json encode_scene(const SceneDescription& scene, ArrayCollector& arrays);

/// "mesh", "image", ... as on the wire.
const char* kind_name(Kind kind);

}  // namespace lambent::description
