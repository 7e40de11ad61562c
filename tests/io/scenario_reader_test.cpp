// SPDX-License-Identifier: Apache-2.0
#include "io/scenario_reader.hpp"

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "io/file.hpp"
#include "io/measurement_csv.hpp"
#include "replaced.hpp"
#include "temporary_folder.hpp"
#include "trammel/core/error.hpp"

namespace {

using namespace trammel;
using test::replaced;

constexpr const char* kScenario = R"(title = "two stations"
[model]
knots_s = {start = 0, stop = 40, step = 10}
[nominal]
position_m = [1000, 2000, 500]
velocity_mps = [30, 0, 1]
[bounds]
position_m = [50, 60, inf]
velocity_mps = 5
acceleration_mps2 = 2
[criterion]
kind = "integral"
[[station]]
name = "radar"
kind = "azimuth_elevation_range"
position_m = [0, 0, 0]
covariance = [[1e-6, 0, 0], [0, 1e-6, 0], [0, 0, 25]]
times_s = {start = 0, stop = 40, step = 2}
[[station]]
name = "ranger"
kind = "range"
position_m = [5000, 0, 0]
covariance = [[9]]
times_s = [0, 20, 40]
[observations]
file = "obs.csv"
[solver]
method = "structured"
relative_gap = 1e-7
max_iterations = 50
threads = 2
relinearise = false
)";

constexpr const char* kObservations =
    "# a comment\n"
    "t_s,station,y1,y2,y3,c11\n"
    "20, ranger, 4100.5,,,16\n"
    "0,radar,0.46,0.22,2290\n"
    "\n"
    "40,ranger,3900\n";

std::string error_of(const std::string& scenario, const std::string& observations = kObservations,
                     const std::string& nominal = "") {
  const test::TemporaryFolder folder;
  (void)folder.write("obs.csv", observations);
  (void)folder.write("nominal.csv", nominal);
  try {
    (void)io::read_scenario(folder.write("s.toml", scenario));
  } catch (const Error& error) {
    return replaced(error.what() + std::string(), folder.path().string() + "/", "");
  }
  return "no error";
}

TEST(ScenarioReader, ReadsEveryField) {
  const test::TemporaryFolder folder;
  (void)folder.write("obs.csv", kObservations);
  const io::ScenarioInput input = io::read_scenario(folder.write("s.toml", kScenario));
  const Scenario& scenario = input.scenario;
  EXPECT_EQ(scenario.title, "two stations");
  EXPECT_EQ(scenario.knots_s, (std::vector<double>{0, 10, 20, 30, 40}));
  EXPECT_EQ(scenario.nominal.velocity_mps, Eigen::Vector3d(30, 0, 1));
  EXPECT_EQ(scenario.bounds.position_m.head<2>(), Eigen::Vector2d(50, 60));
  EXPECT_TRUE(std::isinf(scenario.bounds.position_m[2]));
  ASSERT_EQ(scenario.bounds.acceleration_mps2.size(), 4U);
  EXPECT_EQ(scenario.bounds.acceleration_mps2[3], Eigen::Vector3d(2, 2, 2));
  ASSERT_EQ(scenario.stations.size(), 2U);
  EXPECT_EQ(scenario.stations[0].times_s.size(), 21U);
  EXPECT_EQ(scenario.stations[1].kind, SensorKind::kRange);
  ASSERT_EQ(scenario.observations.size(), 3U);
  EXPECT_EQ(scenario.observations[0].station, 1U);
  ASSERT_TRUE(scenario.observations[0].covariance.has_value());
  EXPECT_EQ((*scenario.observations[0].covariance)(0, 0), 16.0);
  EXPECT_EQ(scenario.observations[1].value, Eigen::Vector3d(0.46, 0.22, 2290));
  EXPECT_FALSE(scenario.observations[2].covariance.has_value());
  EXPECT_EQ(input.settings.estimate.solver.relative_gap, 1e-7);
  EXPECT_EQ(input.settings.estimate.solver.max_iterations, 50);
  EXPECT_EQ(input.settings.estimate.solver.threads, 2);
  EXPECT_FALSE(input.settings.relinearise);
  ASSERT_EQ(input.inputs.size(), 2U);
  EXPECT_EQ(input.inputs[0].name, "s.toml");
  EXPECT_EQ(input.inputs[0].sha256, io::sha256(kScenario));
  EXPECT_EQ(input.inputs[1].name, "obs.csv");
  EXPECT_EQ(input.inputs[1].sha256, io::sha256(kObservations));
}

TEST(ScenarioReader, AccelerationPerSegmentAndZeroAndInfinity) {
  const test::TemporaryFolder folder;
  (void)folder.write("obs.csv", kObservations);
  const auto bounds = [&](const std::string& text) {
    const auto file =
        folder.write("s.toml", replaced(kScenario, "acceleration_mps2 = 2", "acceleration_mps2 = " + text));
    return io::read_scenario(file).scenario.bounds.acceleration_mps2;
  };
  const auto mixed = bounds("[1, [1, 2, 3], 0, inf]");
  ASSERT_EQ(mixed.size(), 4U);
  EXPECT_EQ(mixed[0], Eigen::Vector3d(1, 1, 1));
  EXPECT_EQ(mixed[1], Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(mixed[2], Eigen::Vector3d::Zero());
  EXPECT_TRUE(std::isinf(mixed[3][1]));
  const auto axes = bounds("[4, 5, 6]");
  ASSERT_EQ(axes.size(), 4U);
  EXPECT_EQ(axes[2], Eigen::Vector3d(4, 5, 6));
}

TEST(ScenarioReader, NominalFromFile) {
  const test::TemporaryFolder folder;
  (void)folder.write("obs.csv", kObservations);
  (void)folder.write("nominal.csv", "t_s,x_m,y_m,z_m\n0,0,0,1\n20,10,0,1\n40,20,5,1\n");
  const auto file =
      folder.write("s.toml", replaced(kScenario, "position_m = [1000, 2000, 500]\nvelocity_mps = [30, 0, 1]",
                                      "file = \"nominal.csv\""));
  const io::ScenarioInput input = io::read_scenario(file);
  EXPECT_EQ(input.scenario.nominal.sample_times_s, (std::vector<double>{0, 20, 40}));
  EXPECT_EQ(input.scenario.nominal.sample_positions_m[2], Eigen::Vector3d(20, 5, 1));
  EXPECT_EQ(input.inputs[1].name, "nominal.csv");
}

TEST(ScenarioReader, StationsThatMoveAndErr) {
  const test::TemporaryFolder folder;
  (void)folder.write("obs.csv", kObservations);
  (void)folder.write("ship.csv", "t_s,x_m,y_m,z_m\n-1,0,0,1\n50,10,0,1\n");
  std::string text = replaced(kScenario, "position_m = [0, 0, 0]",
                              "file = \"ship.csv\"\nbias = {range_m = 30, azimuth_rad = inf, time_s = 0.1}");
  text = replaced(text, "position_m = [5000, 0, 0]", "track = [[0, 5000, 0, 0], [41, 5000, 100, 7]]");
  const io::ScenarioInput input = io::read_scenario(folder.write("s.toml", text));
  const std::vector<Station>& stations = input.scenario.stations;
  EXPECT_EQ(stations[0].track.times_s, (std::vector<double>{-1, 50}));
  EXPECT_EQ(stations[0].track.positions_m[1], Eigen::Vector3d(10, 0, 1));
  ASSERT_EQ(stations[0].bias.components.size(), 3);
  EXPECT_TRUE(std::isinf(stations[0].bias.components(0)));
  EXPECT_EQ(stations[0].bias.components.tail<2>(), Eigen::Vector2d(0, 30));
  EXPECT_EQ(stations[0].bias.time_s, 0.1);
  EXPECT_EQ(stations[1].track.times_s, (std::vector<double>{0, 41}));
  EXPECT_EQ(stations[1].track.positions_m[1], Eigen::Vector3d(5000, 100, 7));
  EXPECT_EQ(stations[1].bias.components.size(), 0);
  EXPECT_EQ(input.inputs[1].name, "ship.csv");
}

TEST(ScenarioReader, JsonIsTheSameTree) {
  const test::TemporaryFolder folder;
  const auto input = io::read_scenario(folder.write("s.json", R"({"model": {"knots_s": [0, 10]},
    "nominal": {"position_m": [1, 2, 3], "velocity_mps": [0, 0, 0]},
    "bounds": {"position_m": 1, "velocity_mps": "inf", "acceleration_mps2": [0]},
    "criterion": {"kind": "window", "window_s": [2, 3]},
    "station": [{"name": "a", "kind": "position", "covariance": [[1,0,0],[0,1,0],[0,0,1]], "times_s": [5]}]})"));
  EXPECT_EQ(input.scenario.criterion.kind, CriterionKind::kWindow);
  EXPECT_EQ(input.scenario.bounds.acceleration_mps2.size(), 1U);
  EXPECT_EQ(input.scenario.stations[0].kind, SensorKind::kPosition);
  EXPECT_TRUE(input.scenario.observations.empty());
}

/// One edit of the good scenario and the message it must give.
struct BadCase {
  const char* from;
  const char* to;
  const char* message;
};

TEST(ScenarioReader, BadScenariosNameLineKeyFoundAndExpected) {
  const std::vector<BadCase> cases{
      {"stop = 40, step = 10", "stop = 40, step = nan",
       "s.toml:3: model.knots_s.step: found nan, expected a number"},
      {"{start = 0, stop = 40, step = 10}", "[0, 10, 10, 40]",
       "s.toml:3: model.knots_s: found 10 after 10, expected strictly increasing knots"},
      {"{start = 0, stop = 40, step = 10}", "[0]",
       "s.toml:3: model.knots_s: found 1 knots, expected at least two"},
      {"[1000, 2000, 500]", "[1000, 2000]",
       "s.toml:5: nominal.position_m: found an array of 2, expected an array of 3 numbers"},
      {"[30, 0, 1]", "[30, inf, 1]",
       "s.toml:6: nominal.velocity_mps[1]: found inf, expected a finite number"},
      {"velocity_mps = 5", "velocity_mps = -5",
       "s.toml:9: bounds.velocity_mps: found -5, expected a bound of at least 0"},
      {"[50, 60, inf]", "[50, nan, inf]", "s.toml:8: bounds.position_m[1]: found nan, expected a number"},
      {"velocity_mps = 5\n", "", "bounds: found no key 'velocity_mps', expected it to be given"},
      {"acceleration_mps2 = 2", "acceleration_mps2 = [2, 2]",
       "s.toml:10: bounds.acceleration_mps2: found an array of 2, expected a radius, 3 semi-axes, or one of "
       "these "
       "for each of the 4 segments"},
      {"acceleration_mps2 = 2", "acceleration_mps2 = [1, 1, [1, 1], 1]",
       "bounds.acceleration_mps2[2]: found an array of 2, expected a radius or 3 semi-axes"},
      {"acceleration_mps2 = 2", "acceleration_kmps2 = 2", "expected it to be given"},
      {"kind = \"integral\"", "kind = \"mean\"",
       "s.toml:12: criterion.kind: found \"mean\", expected one of"},
      {"kind = \"integral\"", "kind = \"window\"\nwindow_s = [20, 10]",
       "found 20 to 10, expected [begin, end]"},
      {"kind = \"integral\"", "kind = \"window\"\nwindow_s = [20, 41]",
       "criterion.window_s: found time 41 s, expected a time within the knots, 0 to 40 s"},
      {"kind = \"integral\"", "kind = \"times\"\ntimes_s = []", "criterion.times_s: found no times"},
      {"kind = \"integral\"", "times_s = [1]", "expected it only with kind \"times\""},
      {"name = \"ranger\"", "name = \"radar\"", "station[1].name: found \"radar\" a second time"},
      {"kind = \"range\"", "kind = \"sonar\"",
       "s.toml:21: station[1].kind: found \"sonar\", expected one of"},
      {"[[9]]", "[[9, 0], [0, 9]]", "s.toml:23: station[1] covariance: found 2 x 2 entries, expected 1 x 1"},
      {"[[9]]", "[[-9]]",
       "s.toml:23: station[1] covariance: found variance -9.000000, expected a positive definite matrix"},
      {"[[9]]", "[[inf]]", "station[1].covariance[0][0]: found inf, expected a finite number"},
      {"[0, 1e-6, 0]", "[1e-7, 1e-6, 0]",
       "s.toml:17: station[0] covariance: found entries 0.000000 and 0.000000 in mirrored places, expected a "
       "symmetric"},
      {"[[1e-6, 0, 0], [0, 1e-6, 0]", "[[1e-6, 2e-6, 0], [2e-6, 1e-6, 0]",
       "s.toml:17: station[0] covariance: found a matrix with a negative or zero eigenvalue"},
      {"[[1e-6, 0, 0], [0, 1e-6, 0]", "[[1e-6, 1e-6, 0], [1e-6, 1e-6, 0]",
       "s.toml:17: station[0] covariance: found a matrix with a negative or zero eigenvalue"},
      {"times_s = [0, 20, 40]", "times_s = [0, 20, 40.5]",
       "s.toml:24: station[1].times_s: found time 40.5 s, expected a time within the knots, 0 to 40 s"},
      {"times_s = [0, 20, 40]", "time_s = [0, 20, 40]", "s.toml:24: station[1].time_s: found an unknown key"},
      {"title", "titel", "titel: found an unknown key"},
      {"position_m = [5000, 0, 0]", "position_m = [5000, 0, 0]\nfile = \"ship.csv\"",
       "station[1]: found more than one of position_m, file and track, expected one of them"},
      {"position_m = [5000, 0, 0]", "track = [[0, 1, 2], [1, 1, 2]]",
       "s.toml:22: station[1].track: found 2 rows of 3 numbers, expected at least two rows"},
      {"position_m = [5000, 0, 0]", "track = [[5, 1, 2, 3], [5, 1, 2, 3]]",
       "s.toml:22: station[1].track: found 5 s after 5 s, expected strictly increasing times"},
      {"position_m = [5000, 0, 0]", "file = \"absent.csv\"", "absent.csv: found No such file"},
      {"[[9]]", "[[9]]\nbias = {azimuth_rad = 1}",
       "station[1].bias.azimuth_rad: found a bias of something else, expected range_m, time_s"},
      {"[[9]]", "[[9]]\nbias = {range_m = -1}",
       "station[1].bias.range_m: found -1, expected a bound of at least 0"},
      {"relative_gap = 1e-7", "relative_gap = 0",
       "solver.relative_gap: found 0, expected a number between 0 and 1"},
      {"max_iterations = 50", "max_iterations = 2.5",
       "solver.max_iterations: found 2.5, expected a whole number"},
      {"threads = 2", "threads = -1", "solver.threads: found -1, expected a whole number from 0 to 10000"},
      {"relinearise = false", "relinearise = 1", "solver.relinearise: found 1, expected true or false"},
      {"relinearise = false", "relinearise = false\ncross_fit = true",
       "solver.cross_fit: found true beside relinearise = false, expected one of the two"},
      {"velocity_mps = 5", "velocity_mps = 5\nminimum_height_m = \"low\"",
       "bounds.minimum_height_m: found \"low\", expected a number"},
      {"velocity_mps = 5", "velocity_mps = 5\njerk_mps3 = -1", "bounds.jerk_mps3: found -1, expected"},
      {"velocity_mps = 5", "velocity_mps = 5\njerk_mps3 = 1\nmodel_error_m = 2",
       "bounds.model_error_m: found it beside jerk_mps3, expected one of the two"},
      {"velocity_mps = 5", "velocity_mps = 5\nmodel_error_m = 2\nmodel_error_kind = \"ball\"",
       "bounds.model_error_kind: found \"ball\""},
      {"\"structured\"", "\"magic\"", "solver.method: found \"magic\""},
      {"obs.csv", "absent.csv", "absent.csv: found No such file or directory, expected a readable file"},
      {"[model]", "[model", "s.toml:2: found"},
      {"position_m = [1000, 2000, 500]", "file = \"nominal.csv\"", "found both a file and a straight line"},
  };
  for (const BadCase& bad : cases) {
    const std::string message = error_of(replaced(kScenario, bad.from, bad.to));
    EXPECT_NE(message.find(bad.message), std::string::npos) << bad.to << "\n  gives " << message;
  }
  EXPECT_NE(error_of("").find("expected it to be given"), std::string::npos);
}

TEST(ScenarioReader, FloorAndModelError) {
  const test::TemporaryFolder folder;
  (void)folder.write("obs.csv", kObservations);
  const auto read = [&](const std::string& keys) {
    return io::read_scenario(
               folder.write("s.toml", replaced(kScenario, "velocity_mps = 5", "velocity_mps = 5\n" + keys)))
        .settings;
  };
  const localise::FlightSettings plain = read("");
  EXPECT_FALSE(plain.minimum_height_m.has_value());
  EXPECT_EQ(plain.model_error.position_m, 0.0);
  const localise::FlightSettings jerk = read("minimum_height_m = -12.5\njerk_mps3 = 0.6");
  EXPECT_EQ(jerk.minimum_height_m, -12.5);
  EXPECT_DOUBLE_EQ(jerk.model_error.position_m, 0.6 * 1000.0 / 24);  // segments of 10 s
  EXPECT_GT(jerk.model_error.velocity_mps, 0.0);
  EXPECT_EQ(jerk.model_error.kind, localise::ModelError::Kind::kEllipsoid);
  const localise::FlightSettings given = read("model_error_m = 3\nmodel_error_kind = \"box\"");
  EXPECT_EQ(given.model_error.position_m, 3.0);
  EXPECT_EQ(given.model_error.kind, localise::ModelError::Kind::kBox);
}

TEST(ScenarioReader, BadMeasurementsNameLineAndColumn) {
  const std::string header = "t_s,station,y1,y2,y3\n";
  const std::vector<std::pair<std::string, const char*>> cases{
      {"", "obs.csv: found an empty file, expected a header line and rows"},
      {"# nothing\n\n", "obs.csv: found an empty file"},
      {header, "obs.csv: found a header and no rows, expected at least one measurement"},
      {header + "0,sonar,1\n", "obs.csv:2: column 'station': found 'sonar', expected one of radar, ranger"},
      {header + "0,,1\n", "obs.csv:2: column 'station': found ''"},
      {header + "0,ranger,1\n41,ranger,1\n",
       "obs.csv:3: column 't_s': found time 41 s, expected a time within the knots, 0 to 40 s"},
      {header + "0,ranger,nan\n", "obs.csv:2: column 'y1': found 'nan', expected a finite number"},
      {header + "inf,ranger,1\n", "obs.csv:2: column 't_s': found 'inf', expected a finite number"},
      {header + "0,ranger,12x\n", "obs.csv:2: column 'y1': found '12x', expected a finite number"},
      {header + "0,ranger,1,2\n",
       "obs.csv:2: column 'y2': found a value, expected 1 values, as 'ranger' measures range"},
      {header + "0,radar,1,2\n", "obs.csv:2: column 'y3': found nothing, expected 3 values"},
      {"t_s,station,y1\n0,radar,1\n", "obs.csv:2: column 'y2': found no such column, expected 3 values"},
      {header + "0,ranger,1,,,,\n", "obs.csv:2: found 7 columns, expected at most the 5 of the header"},
      {"t_s,y1\n0,1\n", "obs.csv: found columns 't_s,y1', expected a column 'station'"},
      {"t_s,station,y1,sigma\n0,ranger,1,2\n", "obs.csv: found an unknown column 'sigma'"},
      {"t_s,station,y1,y1\n0,ranger,1,2\n", "obs.csv: found column 'y1' twice"},
      {"t_s,station,y1,c11\n0,ranger,1,-4\n", "obs.csv:2: covariance: found variance -4"},
      {"t_s,station,y1,c11,c22\n0,ranger,1,4,4\n",
       "obs.csv:2: column 'c22': found a value, expected a covariance of 1 by 1"},
      {"t_s,station,y1,y2,y3,c11\n0,radar,1,1,1,4\n",
       "obs.csv:2: covariance: found no value in c12,c13,c22,c23,c33, expected all entries"},
  };
  for (const auto& [observations, expected] : cases) {
    const std::string message = error_of(kScenario, observations);
    EXPECT_NE(message.find(expected), std::string::npos) << observations << "\n  gives " << message;
  }
}

TEST(ScenarioReader, BadNominalFiles) {
  const std::string scenario = replaced(
      kScenario, "position_m = [1000, 2000, 500]\nvelocity_mps = [30, 0, 1]", "file = \"nominal.csv\"");
  const std::string header = "t_s,x_m,y_m,z_m\n";
  const std::vector<std::pair<std::string, const char*>> cases{
      {"", "nominal.csv: found an empty file"},
      {header, "nominal.csv: found 0 rows, expected at least two samples"},
      {header + "0,1,2,3\n0,1,2,3\n",
       "nominal.csv:3: column 't_s': found 0 after 0, expected strictly increasing"},
      {header + "0,1,2,3\n30,1,2,3\n",
       "nominal.csv: found samples from 0 to 30 s, expected samples that cover"},
      {header + "0,1,2\n40,1,2,3\n", "nominal.csv:2: column 'z_m': found nothing"},
      {"t_s,x_km,y_m,z_m\n0,1,2,3\n", "expected a column 'x_m'"},
      {"t_s,x_m,y_m,z_m,w\n0,1,2,3,4\n", "found an unknown column 'w'"},
  };
  for (const auto& [nominal, expected] : cases) {
    const std::string message = error_of(scenario, kObservations, nominal);
    EXPECT_NE(message.find(expected), std::string::npos) << nominal << "\n  gives " << message;
  }
}

TEST(ScenarioReader, UnreadablePaths) {
  const test::TemporaryFolder folder;
  for (const std::string name : {"absent.toml", "scenario.yaml", "."}) {
    try {
      (void)io::read_scenario(folder.path() / name);
      ADD_FAILURE() << name;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(folder.path().string()), std::string::npos) << error.what();
    }
  }
}

TEST(MeasurementCsv, WrittenMeasurementsReadBackTheSame) {
  const test::TemporaryFolder folder;
  (void)folder.write("obs.csv", kObservations);
  const Scenario scenario = io::read_scenario(folder.write("s.toml", kScenario)).scenario;
  const auto file =
      folder.write("copy.csv", io::format_measurements(scenario.observations, scenario.stations));
  const std::vector<Measurement> copy = io::read_measurements(file, scenario);
  ASSERT_EQ(copy.size(), scenario.observations.size());
  for (std::size_t i = 0; i < copy.size(); ++i) {
    EXPECT_EQ(copy[i].t_s, scenario.observations[i].t_s);
    EXPECT_EQ(copy[i].station, scenario.observations[i].station);
    EXPECT_EQ(copy[i].value, scenario.observations[i].value);
    EXPECT_EQ(copy[i].covariance.has_value(), scenario.observations[i].covariance.has_value());
  }
}

}  // namespace
