// `lambent`: renders saved scenes without Blender, compares and describes pictures, measures integrators.
#include <cstdio>
#include <exception>

#include "engine/base/log.h"
#include "engine/base/memory.h"
#include "engine/cli/commands.h"

namespace {

int run(int argc, char** argv) {
  CLI::App program("lambent: renders saved scenes, describes, compares and measures pictures.");
  program.set_version_flag("--version", std::string("lambent ") + LAMBENT_VERSION);
  program.require_subcommand(1);
  std::string log_level = "warn";
  program.add_option("--log-level", log_level, "trace, debug, info, warn or error")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error"}))
      ->capture_default_str();
  const lambent::Command commands[] = {lambent::add_render_command(program), lambent::add_info_command(program),
                                       lambent::add_diff_command(program), lambent::add_measure_command(program),
                                       lambent::add_sheet_command(program)};
  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return program.exit(error) == 0 ? 0 : 2;
  }
  lambent::set_up_log(log_level, {});
  if (const std::string missing = lambent::missing_instructions(); !missing.empty()) {
    std::fprintf(stderr, "lambent: %s\n", missing.c_str());
    return 1;
  }
  for (const lambent::Command& command : commands)
    if (command.app->parsed()) return command.run();
  return 2;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& exception) {
    std::fprintf(stderr, "lambent: %s\n", exception.what());
    return 1;
  }
}
