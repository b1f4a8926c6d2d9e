// Flush-to-zero and denormals-are-zero: what Embree asks of every thread that traces.
#pragma once

#if defined(__SSE2__)
#include <pmmintrin.h>
#include <xmmintrin.h>
#endif

namespace lambent {

/// Sets both modes for the calling thread. Numerics must therefore not lean on denormals.
inline void set_flush_denormals() {
#if defined(__SSE2__)
  _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
  _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
#endif
}

}  // namespace lambent
