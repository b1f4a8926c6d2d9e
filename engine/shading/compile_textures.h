// Definitions of the texture nodes.
#pragma once

#include <map>
#include <string>

#include "engine/shading/compiler.h"

namespace lambent {

/// Node type to its definition; part of value_nodes().
const std::map<std::string, ValueNode>& texture_nodes();

}  // namespace lambent
