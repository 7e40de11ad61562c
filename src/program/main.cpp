// SPDX-License-Identifier: Apache-2.0
#include <exception>
#include <iostream>
#include <new>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

#include "../io/file.hpp"
#include "commands.hpp"
#include "trammel/core/config.hpp"
#include "trammel/core/error.hpp"

namespace {

constexpr const char* kDescription =
    "trammel: guaranteed trajectory estimation from ground measurements and physical bounds.\n"
    "Exit codes: 0 solved, 2 bad input, 3 unbounded, 4 not converged (the result is still written).";

}  // namespace

int main(int argc, char** argv) {
  using trammel::program::AddCommand;
  using trammel::program::ExitCode;
  CLI::App app(kDescription, "trammel");
  app.set_version_flag("--version", std::string("trammel ") + trammel::kVersion);
  app.require_subcommand(1);
  trammel::program::Action action;
  for (const AddCommand add : trammel::program::kCommands) {
    add(app, action);
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? ExitCode::kSolved : ExitCode::kBadInput;
  }
  trammel::io::install_interrupt_handler();
  try {
    return action();
  } catch (const trammel::Error& error) {
    std::cerr << "trammel: " << error.what() << "\n";
    return ExitCode::kBadInput;
  } catch (const std::bad_alloc&) {
    std::cerr << "trammel: not enough memory for a problem of this size\n";
    return ExitCode::kBadInput;
  } catch (const std::exception& error) {
    std::cerr << "trammel: internal error: " << error.what() << "\n";
    return ExitCode::kNotConverged;
  }
}
