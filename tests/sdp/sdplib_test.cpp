// SPDX-License-Identifier: Apache-2.0
// Problems of the public collection SDPLIB 1.2 (Borchers 1999), read from the shared folder beside the
// repository where that exists. Optima: computed elsewhere with 32 digits, printed with 16.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <ostream>
#include <string>

#include <gtest/gtest.h>

#include "io/file.hpp"
#include "trammel/sdp/sdpa_format.hpp"
#include "trammel/sdp/solve.hpp"

namespace {

using trammel::sdp::Solution;
using trammel::sdp::Status;

struct Instance {
  const char* name;
  double optimum;
  double tolerance;  ///< relative, of both objectives
};

void PrintTo(const Instance& instance, std::ostream* stream) { *stream << instance.name; }

std::filesystem::path file_of(const std::string& name) {
  return std::filesystem::path(TRAMMEL_SOURCE_DIR) / ".." / "shared" / "sdplib" / (name + ".dat-s");
}

class Sdplib : public testing::TestWithParam<Instance> {};

TEST_P(Sdplib, ReachesTheOptimum) {
  const Instance& instance = GetParam();
  const std::filesystem::path file = file_of(instance.name);
  if (!std::filesystem::exists(file)) {
    GTEST_SKIP() << "the collection is not beside the repository";
  }
  const auto problem = trammel::sdp::parse_sdpa(trammel::io::read_text(file), file.string());
  const Solution solution = trammel::sdp::solve(problem);
  EXPECT_EQ(solution.status, Status::kOptimal);
  EXPECT_NEAR(solution.primal_objective, instance.optimum, instance.tolerance * std::abs(instance.optimum));
  EXPECT_NEAR(solution.dual_objective, instance.optimum, instance.tolerance * std::abs(instance.optimum));
  for (const double error : solution.dimacs) {
    EXPECT_LE(std::abs(error), 1e-7);
  }
}

// No interior on one side: gpp (a face that one constraint shows), hinf, qap.
INSTANTIATE_TEST_SUITE_P(
    Easy, Sdplib,
    testing::Values(
        Instance{"arch0", 5.6651727321592960e-01, 1e-6}, Instance{"arch4", 9.7262741740980896e-01, 1e-6},
        Instance{"control1", 1.7784626717523405e+01, 1e-6},
        Instance{"control3", 1.3633266228377314e+01, 1e-6},
        Instance{"control5", 1.6883599050955794e+01, 1e-6}, Instance{"gpp100", -4.4943550773511170e+01, 1e-6},
        Instance{"gpp124-1", -7.3430762628713104e+00, 1e-6},
        Instance{"gpp124-3", -1.5301412729424527e+02, 1e-6},
        Instance{"gpp250-2", -8.1868958839472995e+01, 1e-6},
        Instance{"gpp500-1", -2.5320543873217648e+01, 1e-6}, Instance{"hinf1", 2.0325956131225920e+00, 1e-4},
        Instance{"hinf10", 1.0871168532001478e+02, 1e-4}, Instance{"hinf13", 4.4348500978774837e+01, 1e-4},
        Instance{"hinf2", 1.0967055621049257e+01, 1e-4}, Instance{"hinf5", 3.6219553069603279e+02, 1e-4},
        Instance{"hinf8", 1.1614634285873923e+02, 1e-4}, Instance{"mcp100", 2.2615735148330884e+02, 1e-6},
        Instance{"mcp124-1", 1.4199047709767370e+02, 1e-6},
        Instance{"mcp124-4", 8.6441186405192718e+02, 1e-6},
        Instance{"mcp250-2", 5.3193008393282014e+02, 1e-6},
        Instance{"mcp250-3", 9.8117257166434774e+02, 1e-6},
        Instance{"mcp500-1", 5.9814851691875958e+02, 1e-6}, Instance{"qap5", -4.3599996615202286e+02, 1e-4},
        Instance{"qap7", -4.2481955691116457e+02, 1e-4}, Instance{"theta1", 2.3000000000000000e+01, 1e-6},
        Instance{"theta3", 4.2166981488494407e+01, 1e-6}, Instance{"truss1", -8.9999963152868911e+00, 1e-6},
        Instance{"truss3", -9.1099962092020537e+00, 1e-6}, Instance{"truss5", -1.3263567797250604e+02, 1e-6},
        Instance{"truss7", -9.0000140369343467e+02, 1e-6}, Instance{"truss8", -1.3311458915226342e+02, 1e-6}),
    [](const testing::TestParamInfo<Instance>& instance) {
      std::string name = instance.param.name;
      std::replace(name.begin(), name.end(), '-', '_');
      return name;
    });

TEST(SdplibInfeasible, BothAreRecognisedWithARay) {
  if (!std::filesystem::exists(file_of("infp1"))) {
    GTEST_SKIP() << "the collection is not beside the repository";
  }
  const auto solve_file = [](const std::string& name) {
    return trammel::sdp::solve(trammel::sdp::parse_sdpa(trammel::io::read_text(file_of(name)), name));
  };
  const Solution primal = solve_file("infp1");
  EXPECT_EQ(primal.status, Status::kPrimalInfeasible);
  EXPECT_LE(primal.ray_violation, 1e-8);
  const Solution dual = solve_file("infd1");
  EXPECT_EQ(dual.status, Status::kDualInfeasible);
  EXPECT_LE(dual.ray_violation, 1e-8);
}

}  // namespace
