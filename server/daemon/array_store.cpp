#include "server/daemon/array_store.h"

namespace lambent {

void ArrayStore::add(std::vector<ArrayPointer> arrays) {
  for (ArrayPointer& array : arrays) {
    const auto [entry, is_new] = entries_.try_emplace(array->hash);
    if (is_new) entry->second.array = std::move(array);
    entry->second.first_epoch = -1;
  }
}

ArrayPointer ArrayStore::find(const std::string& hash) const {
  const auto found = entries_.find(hash);
  return found == entries_.end() ? nullptr : found->second.array;
}

std::vector<std::string> ArrayStore::missing(const std::vector<std::string>& hashes) const {
  std::vector<std::string> missing;
  for (const std::string& hash : hashes)
    if (!entries_.contains(hash)) missing.push_back(hash);
  return missing;
}

void ArrayStore::sweep(int64_t epoch) {
  for (auto entry = entries_.begin(); entry != entries_.end();) {
    int64_t& first_epoch = entry->second.first_epoch;
    if (first_epoch < 0) first_epoch = epoch;
    // Values hold arrays by shared pointer: a count of one means that only this store does.
    const bool drop = first_epoch < epoch && entry->second.array.use_count() == 1;
    entry = drop ? entries_.erase(entry) : std::next(entry);
  }
}

void ArrayStore::sweep_all() {
  std::erase_if(entries_, [](const auto& entry) { return entry.second.array.use_count() == 1; });
}

}  // namespace lambent
