// SPDX-License-Identifier: Apache-2.0
#include "io/filter_file.hpp"

#include <cmath>
#include <complex>
#include <string>

#include <gtest/gtest.h>

#include "filter/filter_cases.hpp"
#include "trammel/filter/guaranteed_rule.hpp"
#include "trammel/filter/rules.hpp"

namespace {

using trammel::io::Document;
using trammel::io::FilterFile;
using trammel::io::read_filter_file;
using trammel::test::error_of;
using trammel::test::expect_near;
using trammel::test::vec;

FilterFile read(const std::string& text) { return read_filter_file(Document::parse_toml(text, "f.toml")); }

Eigen::VectorXd gains_of(const std::string& text) {
  return trammel::filter::constant_gains(read(text).specification);
}

TEST(FilterFile, ReadsGainsAndPolynomials) {
  const FilterFile file =
      read("order = 3\nrows = 2\nsampling_s = 0.5\nmode = \"differences\"\ngains = [0.5, 0.3]\n");
  EXPECT_EQ(file.specification.order, 3);
  EXPECT_EQ(file.specification.rows, 2);
  EXPECT_EQ(file.specification.mode, trammel::filter::FilterMode::kDifferences);
  const FilterFile lists = read("order = 2\nsampling_s = 1\na = [[1, 0.2], [1]]\nb = [[0.6, -0.1], [0.8]]\n");
  expect_near(lists.specification.a[0], vec({1.0, 0.2}), 0.0, "a");
  expect_near(lists.specification.b[1], vec({0.8}), 0.0, "b");
  const auto json = Document::parse_json(R"({"order": 1, "sampling_s": 2, "gains": [0.5]})", "f.json");
  EXPECT_EQ(read_filter_file(json).specification.sampling_s, 2.0);
}

TEST(FilterFile, EveryRule) {
  using namespace trammel::filter;
  const std::string head = "order = 2\nsampling_s = 0.5\n";
  const auto rule = [&](const std::string& text) { return gains_of(head + "rule = {" + text + "}\n"); };
  expect_near(rule("name = \"fading_memory\", theta = 0.7"), fading_memory(2, 0.7), 1e-15, "fading");
  expect_near(rule("name = \"critically-damped\", theta = 0.7"), fading_memory(2, 0.7), 1e-15, "damped");
  expect_near(
      rule("name = \"poles\", poles = [[0.6, 0.3], [0.6, -0.3]]"),
      pole_placement(Eigen::Vector2cd(std::complex<double>(0.6, 0.3), std::complex<double>(0.6, -0.3))),
      1e-15, "poles");
  expect_near(rule("name = \"expanding_memory\", samples = 5"), expanding_memory(2, 5), 1e-15, "expanding");
  expect_near(rule("name = \"finite_fading_memory\", theta = 0.8, samples = 5"),
              finite_fading_memory(2, 5, 0.8), 1e-15, "finite");
  expect_near(rule("name = \"kalata\", tracking_index = 0.3"), kalata(2, 0.3), 1e-15, "kalata");
  expect_near(rule("name = \"kalata\", process_std = 3, measurement_std = 2"), kalata(2, 3 * 0.25 / 2), 1e-14,
              "kalata");
  expect_near(rule("name = \"kalman\", tracking_index = 0.3"), kalata(2, 0.3), 1e-12, "kalman");
  expect_near(rule("name = \"kalman\", model = \"increments\", process_std = 3, measurement_std = 2"),
              benedict_bordner_from_index(3 * 0.5 / 2), 1e-12, "increments");
  expect_near(
      rule("name = \"kalman\", model = \"continuous\", process_density_root = 3, measurement_std = 2"),
      kalman(2, ProcessNoise::kContinuous, 3 * std::pow(0.5, 1.5) / 2), 1e-12, "continuous");
  // Physical noise matrix of acceleration noise 3 over 0.5 s: 9 [T^4/4, T^3/2; T^3/2, T^2].
  expect_near(
      rule("name = \"kalman\", process_noise = [[0.140625, 0.5625], [0.5625, 2.25]], measurement_std = 2"),
      kalata(2, 3 * 0.25 / 2), 1e-12, "matrix");
  expect_near(rule("name = \"benedict_bordner\", alpha = 0.4"), benedict_bordner(0.4), 1e-15, "BB");
  expect_near(rule("name = \"minimum_noise\", lag = 1"), minimum_noise_prediction(2, 0.5), 1e-14,
              "prediction");
  expect_near(rule("name = \"minimum_noise\", target = \"filtered\", lag = 1"),
              minimum_noise_estimate(2, 4.0), 1e-14, "estimate");
  const FilterFile file =
      read(head + "rule = {name = \"guaranteed\", derivative_bound = 8, measurement_std = 2}\n");
  GuaranteedGoal goal;  // index 8 * 0.25 / 2 = 1
  const GuaranteedGains best = guaranteed_gains(goal);
  expect_near(constant_gains(file.specification), best.gains, 1e-12, "guaranteed");
  ASSERT_TRUE(file.guaranteed_mse.has_value());
  EXPECT_NEAR(*file.guaranteed_mse, 4.0 * best.mean_square_error, 1e-10);
}

TEST(FilterFile, BadInputNamesTheKey) {
  const auto error = [](const std::string& text) { return error_of([&] { (void)read(text); }); };
  const auto expect_message = [&](const std::string& text, const std::string& part) {
    const std::string message = error(text);
    EXPECT_NE(message.find(part), std::string::npos) << text << "\n gave: " << message;
    EXPECT_NE(message.find("f.toml"), std::string::npos) << message;
  };
  const std::string head = "order = 2\nsampling_s = 1\n";
  expect_message("", "order");
  expect_message("order = 2.5\n", "order");
  expect_message("order = 0\nsampling_s = 1\ngains = []\n", "order");
  expect_message("order = 2\nrows = 3\nsampling_s = 1\ngains = [1, 1, 1]\n", "rows");
  expect_message("order = 2\nsampling_s = 0\ngains = [0.5, 0.3]\n", "sampling_s");
  expect_message("order = 2\nsampling_s = -1\ngains = [0.5, 0.3]\n", "sampling_s");
  expect_message("order = 2\nsampling_s = nan\ngains = [0.5, 0.3]\n", "sampling_s");
  expect_message("order = 2\nsampling_s = inf\ngains = [0.5, 0.3]\n", "sampling_s");
  expect_message(head + "gains = [0.5]\n", "gains");
  expect_message(head + "gains = [0.5, nan]\n", "gains[1]");
  expect_message(head + "gains = [0.5, \"x\"]\n", "gains[1]");
  expect_message(head, "exactly one way");
  expect_message(head + "gains = [0.5, 0.3]\nrule = {name = \"kalata\", tracking_index = 1}\n",
                 "exactly one way");
  expect_message(head + "a = [[0.9], [1]]\nb = [[0.5], [0.5]]\n", "a[0]");
  expect_message(head + "b = [[0.5]]\n", "b");
  expect_message(head + "b = [[0.5], []]\n", "b[1]");
  expect_message(head + "gains = [0.5, 0.3]\ngain = 1\n", "unknown key");
  expect_message(head + "mode = \"other\"\ngains = [0.5, 0.3]\n", "mode");
  expect_message(head + "rule = {name = \"best\"}\n", "fading_memory");
  expect_message(head + "rule = {name = \"fading_memory\"}\n", "theta");
  expect_message(head + "rule = {name = \"fading_memory\", theta = 1}\n", "theta");
  expect_message(head + "rule = {name = \"fading_memory\", theta = 0.5, thetta = 1}\n", "unknown key");
  expect_message(head + "rule = {name = \"kalata\"}\n", "tracking_index");
  expect_message(head + "rule = {name = \"kalata\", tracking_index = 0}\n", "tracking_index");
  expect_message(head + "rule = {name = \"kalata\", process_std = 1}\n", "measurement_std");
  expect_message(head + "rule = {name = \"minimum_noise\", b = 2.5}\n", "b");
  expect_message(head + "rule = {name = \"poles\", poles = [0.5]}\n", "poles");
  expect_message("order = 4\nsampling_s = 1\nrule = {name = \"guaranteed\", tracking_index = 1}\n", "order");
  expect_message("order = 3\nrows = 2\nsampling_s = 1\nrule = {name = \"kalata\", tracking_index = 1}\n",
                 "rows");
  expect_message(head + "gains = [0.5, 0.3]\nbound = {derivative_bound = -1, measurement_std = 1}\n",
                 "derivative_bound");
  expect_message(head + "gains = [0.5, 0.3]\nbatch = {samples = 20}\n", "bound");
  expect_message(head + "gains = [0.5, 0.3]\nrun = {gate = -3}\n", "gate");
}

}  // namespace
