// SPDX-License-Identifier: Apache-2.0
/// @file
/// Runs the program as a user does and keeps what it says.
#pragma once

#include <cstdlib>
#include <string>

#include <sys/wait.h>

#include "io/file.hpp"
#include "io/json_output.hpp"
#include "io/temporary_folder.hpp"

namespace trammel::test {

struct ProgramRun {
  int exit_code = -1;
  std::string output;
  std::string errors;

  [[nodiscard]] io::Json json() const { return io::Json::parse(output); }
};

/// Runs `trammel ARGUMENTS` by the shell, in the folder.
inline ProgramRun run_program(const TemporaryFolder& folder, const std::string& arguments) {
  const TemporaryFolder log;
  const std::string command = "cd '" + folder.path().string() + "' && " TRAMMEL_PROGRAM " " + arguments +
                              " >'" + (log.path() / "out").string() + "' 2>'" +
                              (log.path() / "err").string() + "'";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, io::read_text(log.path() / "out"),
          io::read_text(log.path() / "err")};
}

/// A small flight seen by one radar and one ranging station; replace parts of it to break it.
inline std::string small_scenario(const std::string& extra = "") {
  return R"([model]
knots_s = [0, 10, 20, 30]
[nominal]
position_m = [1000, 2000, 500]
velocity_mps = [30, 0, 1]
[bounds]
position_m = 50
velocity_mps = 5
acceleration_mps2 = 2
[[station]]
name = "radar"
kind = "azimuth_elevation_range"
position_m = [0, 0, 0]
covariance = [[1e-5, 0, 0], [0, 1e-5, 0], [0, 0, 25]]
times_s = {start = 0, stop = 30, step = 1}
[[station]]
name = "ranger"
kind = "range"
position_m = [5000, 0, 0]
covariance = [[9]]
times_s = [3, 11, 27]
)" + extra;
}

/// A true path beside the small scenario's reference.
inline constexpr const char* kSmallTruth =
    "t_s,x_m,y_m,z_m\n-1,980,2000,500\n10,1310,2010,505\n20,1610,2040,520\n31,1950,2080,540\n";

}  // namespace trammel::test
