// The arrays that a session has received, by hash.
#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

#include "engine/description/array.h"

namespace lambent {

/// Keeps an array while a description value uses it, and until the transactions of the first epoch after its arrival
/// are over (a client may split a scene into several transactions of one epoch). Belongs to the session's worker.
class ArrayStore {
 public:
  /// Content that is here already is not replaced.
  void add(std::vector<ArrayPointer> arrays);
  /// Null if there is none.
  ArrayPointer find(const std::string& hash) const;
  /// Those of `hashes` that are not here.
  std::vector<std::string> missing(const std::vector<std::string>& hashes) const;
  /// To be called after a transaction was applied: drops what neither a value nor the rest of this epoch can use.
  void sweep(int64_t epoch);
  /// To be called when a render starts: drops everything that no value uses.
  void sweep_all();
  void clear() { entries_.clear(); }
  size_t size() const { return entries_.size(); }

 private:
  struct Entry {
    ArrayPointer array;
    int64_t first_epoch = -1;  ///< of the first transaction after its arrival
  };
  std::unordered_map<std::string, Entry> entries_;
};

}  // namespace lambent
