// Process memory and processor checks.
#pragma once

#include <cstddef>
#include <string>

namespace lambent {

/// Resident set size of this process in bytes; 0 if unknown.
size_t resident_bytes();
/// Largest resident set size so far in bytes; 0 if unknown.
size_t peak_resident_bytes();
/// Main memory of this machine in bytes.
size_t physical_bytes();
/// Empty if this processor has the instructions that the program was built for; otherwise what to tell the user.
std::string missing_instructions();

}  // namespace lambent
