// SPDX-License-Identifier: Apache-2.0
/// @file
/// The sub-commands of the program; each adds itself to the parser and runs in its callback.
#pragma once

#include <functional>
#include <vector>

#include <CLI/App.hpp>

namespace trammel::program {

/// Exit codes of the program, also in `trammel --help`.
enum ExitCode : int {
  kSolved = 0,
  kBadInput = 2,
  kUnbounded = 3,
  kNotConverged = 4,
};

/// What a sub-command leaves to be run after parsing; returns an exit code.
using Action = std::function<int()>;

/// Adds a sub-command to `app`; sets `action` when it is chosen. One function per file command_*.cpp.
using AddCommand = void (*)(CLI::App& app, Action& action);

void add_estimate(CLI::App& app, Action& action);
void add_design(CLI::App& app, Action& action);
void add_simulate(CLI::App& app, Action& action);
void add_suggest(CLI::App& app, Action& action);
void add_filter_command(CLI::App& app, Action& action);
void add_observer(CLI::App& app, Action& action);
void add_region(CLI::App& app, Action& action);
void add_wind(CLI::App& app, Action& action);
void add_convert(CLI::App& app, Action& action);
void add_solve(CLI::App& app, Action& action);
void add_sdp_command(CLI::App& app, Action& action);
void add_campaign(CLI::App& app, Action& action);

/// All sub-commands in the order of `trammel --help`.
inline const std::vector<AddCommand> kCommands{
    add_estimate, add_design, add_simulate, add_suggest, add_filter_command, add_observer,
    add_region,   add_wind,   add_convert,  add_solve,   add_sdp_command,    add_campaign};

}  // namespace trammel::program
