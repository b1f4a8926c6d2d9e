// What image files say about Cryptomatte layers, so that keyers know the names.
#pragma once

#include <map>
#include <string>

#include "engine/description/description.h"

namespace lambent {

/// Adds the metadata of each Cryptomatte pass that the settings ask for: name, hash, conversion and manifest (Friedman
/// & Jones 2015, "Cryptomatte specification", 1.2).
void add_cryptomatte_metadata(const description::SceneDescription& scene, std::map<std::string, std::string>& metadata);

}  // namespace lambent
