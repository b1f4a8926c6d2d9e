#include "engine/base/check.h"

#include <cstdio>
#include <cstdlib>

namespace lambent {

RenderContext& render_context() {
  thread_local RenderContext context;
  return context;
}

void check_failed(const char* expression, const char* file, int line, const std::string& message) {
  std::fprintf(stderr, "lambent: check failed: %s at %s:%d %s\n", expression, file, line, message.c_str());
  const RenderContext& context = render_context();
  if (context.pixel_x >= 0)
    std::fprintf(stderr, "lambent: replay with: lambent render %s --region %d %d %d %d --samples %ld\n",
                 context.scene ? context.scene : "<scene>", context.pixel_x, context.pixel_y, context.pixel_x + 1,
                 context.pixel_y + 1, context.sample + 1);
  std::fflush(stderr);
  std::abort();
}

}  // namespace lambent
