// The subcommands of `lambent`. Each adds its options to the program and gives back what to run: a function that
// returns the exit code.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace lambent {

/// A subcommand and what it does when chosen.
struct Command {
  CLI::App* app = nullptr;
  std::function<int()> run;
};

/// `lambent render scene.lambent -o out.exr`: 0 finished, 1 failed, 130 interrupted with the picture saved.
Command add_render_command(CLI::App& program);
/// `lambent info FILE`: what a saved scene or an image holds.
Command add_info_command(CLI::App& program);
/// `lambent diff A B`: 0 within the thresholds, 1 not, 2 when they cannot be compared.
Command add_diff_command(CLI::App& program);
/// `lambent measure`: error against time of integrators on one scene. 0 measured, 1 failed, 130 interrupted with what
/// was measured before written.
Command add_measure_command(CLI::App& program);
/// `lambent sheet`: a labelled contact sheet of images. 0 written, 1 failed.
Command add_sheet_command(CLI::App& program);

}  // namespace lambent
