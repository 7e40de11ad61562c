// SPDX-License-Identifier: Apache-2.0
#include <exception>
#include <iostream>
#include <new>
#ifdef __GLIBC__
#include <malloc.h>
#endif

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

/// Matrices of some hundred kilobytes come and go with every solution: their memory is kept for the next ones
/// instead of being handed back to the system and cleared by it each time, which took a third of the time of
/// a campaign. Those above 32 MB are still handed back.
void keep_freed_memory() {
#ifdef __GLIBC__
  constexpr int kLargestKept = 32 << 20;
  constexpr int kMostKept = 1 << 30;
  mallopt(M_MMAP_THRESHOLD, kLargestKept);
  mallopt(M_TRIM_THRESHOLD, kMostKept);
#endif
}

}  // namespace

int main(int argc, char** argv) {
  using trammel::program::AddCommand;
  using trammel::program::ExitCode;
  keep_freed_memory();
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
