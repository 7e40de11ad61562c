// SPDX-License-Identifier: Apache-2.0
/// Every case and table of the reference file, where it is at hand.
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "filter/filter_cases.hpp"
#include "trammel/filter/fading_memory_filter.hpp"
#include "trammel/filter/fixed_gain_filter.hpp"
#include "trammel/filter/general_method.hpp"
#include "trammel/filter/guaranteed_rule.hpp"
#include "trammel/filter/rules.hpp"
#include "trammel/filter/worst_case.hpp"

namespace {

using namespace trammel::filter;
using nlohmann::json;
using trammel::test::design_of;
using trammel::test::expect_near;
using trammel::test::vec;

Eigen::VectorXd vector_of(const json& list) {
  Eigen::VectorXd values(static_cast<Eigen::Index>(list.size()));
  for (std::size_t i = 0; i < list.size(); ++i) {
    values[static_cast<Eigen::Index>(i)] = list[i].get<double>();
  }
  return values;
}

class Reference : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::filesystem::path file = std::filesystem::path(TRAMMEL_SOURCE_DIR) / ".." / "shared" /
                                       "reference" / "invariant-filters" / "reference.json";
    if (!std::filesystem::exists(file)) {
      GTEST_SKIP() << "the reference file of the invariant filters is not at hand";
    }
    data_ = json::parse(std::ifstream(file));
  }
  json data_;
};

FilterDesign design_of_case(const json& c) {
  FilterSpecification specification;
  specification.order = c["v"];
  specification.rows = c["k"];
  specification.sampling_s = c["T"];
  specification.mode = c["method"] == "derivatives" ? FilterMode::kDerivatives : FilterMode::kDifferences;
  for (const json& a : c["a"]) {
    specification.a.push_back(vector_of(a));
  }
  for (const json& b : c["b"]) {
    specification.b.push_back(vector_of(b));
  }
  return synthesise(specification);
}

TEST_F(Reference, TransferFunctionsAndResponses) {
  constexpr double kTransfer = 1e-12;
  for (const json& c : data_["cases"]) {
    const std::string name = c["name"];
    const FilterDesign design = design_of_case(c);
    expect_near(design.denominator, vector_of(c["den"]), kTransfer, name + " denominator");
    expect_near(design.prediction_numerator, vector_of(c["pred_num"]), kTransfer, name + " prediction");
    expect_near(design.innovation_numerator, vector_of(c["innov_num"]), kTransfer, name + " innovation");
    Eigen::VectorXd t = Eigen::VectorXd::LinSpaced(10, 0.0, 9.0) * c["T"].get<double>();
    const std::pair<const char*, Eigen::VectorXd> inputs[] = {
        {"impulse", Eigen::VectorXd::Unit(10, 0)},
        {"step", Eigen::VectorXd::Ones(10)},
        {"ramp_2_plus_3t", (2.0 + 3.0 * t.array()).matrix()},
        {"parabola_1_minus_t_plus_1p5t2", (1.0 - t.array() + 1.5 * t.array().square()).matrix()}};
    for (int row = 0; row < design.specification.rows; ++row) {
      const auto at = static_cast<std::size_t>(row);
      expect_near(design.numerators[at], vector_of(c["est_num"][at]), kTransfer, name + " numerator");
      for (const auto& [key, input] : inputs) {
        expect_near(response(design, row, input), vector_of(c[key]["est"][at]), kTransfer, name + " " + key);
      }
    }
    for (const auto& [key, input] : inputs) {
      expect_near(prediction_response(design, input), vector_of(c[key]["pred"]), kTransfer, name + " " + key);
    }
  }
}

TEST_F(Reference, Analysis) {
  for (const json& c : data_["cases"]) {
    const std::string name = c["name"];
    const FilterAnalysis analysis = analyse(design_of_case(c));
    EXPECT_EQ(analysis.stable, c["stable"].get<bool>()) << name;
    EXPECT_EQ(analysis.astatism, c["astatism_est"].get<std::vector<int>>()) << name;
    EXPECT_EQ(analysis.prediction_astatism, c["astatism_pred"].get<int>()) << name;
    if (name.find("crit") == std::string::npos) {
      for (const json& pole : c["poles_z"]) {
        const std::complex<double> expected(pole[0].get<double>(), pole[1].get<double>());
        double nearest = 1.0;
        for (const auto& found : analysis.poles) {
          nearest = std::min(nearest, std::abs(found - expected));
        }
        EXPECT_LE(nearest, 1e-8) << name;
      }
    }
    if (!analysis.stable) {
      continue;
    }
    for (std::size_t row = 0; row < c["noise_gain"].size(); ++row) {
      const auto at = static_cast<Eigen::Index>(row);
      expect_near(analysis.covariance.row(at).transpose(), vector_of(c["noise_gain"][row]), 1e-10, name);
      expect_near(analysis.error_coefficients.row(at).transpose(),
                  vector_of(c["error_coefficients_est"][row]), 1e-9, name);
    }
    expect_near(analysis.prediction_error_coefficients, vector_of(c["error_coefficients_pred"]), 1e-9, name);
    EXPECT_NEAR(analysis.prediction_noise_gain, c["noise_gain_pred"].get<double>(), 1e-10) << name;
    EXPECT_NEAR(analysis.innovation_variance, c["innovation_variance_over_R"].get<double>(), 1e-10) << name;
  }
}

TEST_F(Reference, Coefficients) {
  constexpr double kExactly = 1e-12;
  const json& c = data_["coefficients"];
  for (const json& e : c["kalata_alpha"]) {
    expect_near(kalata(1, e["Lambda"]), vec({e["alpha"]}), kExactly, "kalata 1");
  }
  for (const json& e : c["kalata_alpha_beta"]) {
    expect_near(kalata(2, e["Lambda"]), vec({e["alpha"], e["beta"]}), kExactly, "kalata 2");
  }
  for (const json& e : c["kalata_alpha_beta_gamma"]) {
    expect_near(kalata(3, e["Lambda"]), vec({e["alpha"], e["beta"], e["gamma"]}), kExactly, "kalata 3");
  }
  for (const json& e : c["cwna_alpha_beta"]) {
    expect_near(kalman(2, ProcessNoise::kContinuous, e["Lambda_c"]), vec({e["alpha"], e["beta"]}), kExactly,
                "cwna");
  }
  for (const json& e : c["benedict_bordner"]) {
    expect_near(benedict_bordner_from_index(e["Lambda_v"]), vec({e["alpha"], e["beta"]}), kExactly, "BB");
  }
  for (const json& e : c["fading_memory"]) {
    expect_near(fading_memory(e["v"], e["theta"]), vector_of(e["kappa"]), kExactly, "fading");
  }
  const auto unit_gains = [](Eigen::VectorXd gains) {
    for (Eigen::Index i = 0; i < gains.size(); ++i) {
      gains[i] /= factorial(static_cast<int>(i));
    }
    return gains;
  };
  for (const json& e : c["expanding_memory"]) {
    expect_near(unit_gains(expanding_memory(e["v"], e["n"])), vector_of(e["gains_T1"]), kExactly,
                "expanding");
  }
  for (const json& e : c["finite_fading_memory"]) {
    expect_near(unit_gains(finite_fading_memory(e["v"], e["n"], e["theta"])), vector_of(e["gains_T1"]), 1e-11,
                "finite fading");
  }
  for (const json& e : c["min_noise_prediction"]) {
    expect_near(minimum_noise_prediction(e["v"], e["b"]), vector_of(e["kappa"]), kExactly, "minimum noise");
  }
  for (const json& e : c["min_noise_filtered_v2"]) {
    expect_near(minimum_noise_estimate(2, e["lag"]), vec({e["alpha"], e["beta"]}), kExactly, "minimum noise");
  }
}

TEST_F(Reference, GuaranteedErrors) {
  const json& tables = data_["minimax_numeric_v2"];
  for (const std::string key :
       {"filt_dc", "filt_L1s", "filt_L1c", "pred_dc", "pred_L1s", "pred_L1c", "vel_L1c"}) {
    for (const json& e : tables[key]) {
      GuaranteedGoal goal;
      goal.index = e["Lambda"];
      goal.output = {.row = key.starts_with("vel") ? 1 : 0, .predicted = key.starts_with("pred")};
      goal.manoeuvre = key.ends_with("dc")    ? Manoeuvre::kConstant
                       : key.ends_with("L1s") ? Manoeuvre::kPiecewiseConstant
                                              : Manoeuvre::kArbitrary;
      const GuaranteedGains best = guaranteed_gains(goal);
      EXPECT_NEAR(best.mean_square_error / e["J"].get<double>(), 1.0, 1e-9) << key << " " << goal.index;
      expect_near(best.gains, vec({e["alpha"], e["beta"]}), 1e-6, key);
    }
  }
  for (const json& e : data_["coefficients"]["minimax_v1_velocity_bound"]) {
    GuaranteedGoal goal;
    goal.order = 1;
    goal.index = e["Lambda"];
    EXPECT_NEAR(guaranteed_gains(goal).mean_square_error / e["filt"][1].get<double>(), 1.0, 1e-10);
    goal.output.predicted = true;
    EXPECT_NEAR(guaranteed_gains(goal).mean_square_error / e["pred"][1].get<double>(), 1.0, 1e-10);
  }
  for (const json& e : data_["alpha_beta_performance"]["table"]) {
    const FilterDesign design = design_of(2, 1.0, vec({e["alpha"], e["beta"]}));
    const std::pair<const char*, FilterOutput> outputs[] = {
        {"filt", {0, false}}, {"pred", {0, true}}, {"vel", {1, false}}};
    for (const auto& [key, output] : outputs) {
      const WorstCaseBias bias = worst_case_bias(design, output);
      expect_near(vec({bias.constant, bias.piecewise_constant, bias.arbitrary}),
                  vec({e[key]["dc"], e[key]["L1s"], e[key]["L1c"]}), 1e-9, key);
    }
  }
}

/// The recursion over the times of the reference: estimates and gains from `order` samples on.
template <int Order>
void expect_irregular(const json& table, const std::string& key) {
  FadingMemoryFilter<double, Order> filter(table["tau"].get<double>(), 1.0);
  std::size_t entry = 0;
  double before = table["t"][0];
  for (std::size_t n = 0; n < table["t"].size(); ++n) {
    const double now = table["t"][n];
    filter.predict(now - before);
    before = now;
    filter.correct(Eigen::Matrix<double, 1, 1>(table["z"][n].get<double>()));
    const json& e = table[key][entry];
    if (e["n"].get<std::size_t>() == n + 1) {
      expect_near(filter.state().col(0), vector_of(e["estimate"]), 1e-9, key + " estimate");
      expect_near(filter.gain(), vector_of(e["gain"]), 1e-9, key + " gain");
      entry = std::min(entry + 1, table[key].size() - 1);
    }
  }
  EXPECT_EQ(entry, table[key].size() - 1);
}

TEST_F(Reference, IrregularSampling) {
  expect_irregular<2>(data_["irregular_fading_memory"], "v2");
  expect_irregular<3>(data_["irregular_fading_memory"], "v3");
}

TEST_F(Reference, Coasting) {
  const json& c = data_["coasting_alpha_beta"];
  FixedGainFilter<double, 2> filter(vec({c["alpha"], c["beta"]}), c["T"].get<double>());
  filter.set_state(vector_of(c["initial_state_at_n0"]));
  for (std::size_t n = 0; n < c["z"].size(); ++n) {
    if (n > 0) {
      filter.predict();
    }
    if (!c["z"][n].is_null()) {
      filter.correct(Eigen::Matrix<double, 1, 1>(c["z"][n].get<double>()));
    }
    expect_near(filter.state().col(0), vector_of(c["estimates"][n]), 1e-12, "sample " + std::to_string(n));
  }
}

TEST_F(Reference, RandomManoeuvresAndTheFormulasOfOthers) {
  const auto random_error = [](double index, const Eigen::VectorXd& gains) {
    return analyse(design_of(2, 1.0, gains)).covariance(0, 0) +
           index * index * std::pow(1.0 - gains[0], 2) / (2.0 * gains[0] * gains[1]);
  };
  for (const json& e : data_["dwna_mse_comparison"]["table"]) {
    const double index = e["Lambda"];
    EXPECT_NEAR(random_error(index, kalata(2, index)), e["kalman"].get<double>(), 1e-10);
    EXPECT_NEAR(random_error(index, fading_memory(2, e["theta_crit"])), e["crit"].get<double>(), 1e-10);
    EXPECT_NEAR(kalata(2, index)[0], e["alpha_kalman"].get<double>(), 1e-12);
  }
  const json& ghk = data_["peer_checks"]["ghk"];
  const FilterAnalysis three =
      analyse(design_of(3, ghk["dt"], vec({ghk["g"], ghk["h"], 4.0 * ghk["k"].get<double>()})));
  expect_near(three.covariance.diagonal(), vector_of(ghk["correct_VRF"]), 1e-10, "g-h-k");
  EXPECT_NEAR(three.prediction_noise_gain, ghk["correct_VRF_prediction"].get<double>(), 1e-10);
  const json& memory = data_["peer_checks"]["fading_memory_order1"];
  const FilterAnalysis two = analyse(design_of(2, memory["dt"], fading_memory(2, memory["theta"])));
  expect_near(two.covariance.diagonal(), vector_of(memory["correct_P"]), 1e-10, "fading memory");
  expect_near(2.0 * two.error_coefficients.col(2), vector_of(memory["correct_lag_for_a2_equal_1"]), 1e-9,
              "fading memory");
}

double rational_text(const std::string& text) {
  const std::size_t slash = text.find('/');
  return slash == std::string::npos ? std::stod(text)
                                    : std::stod(text.substr(0, slash)) / std::stod(text.substr(slash + 1));
}

std::complex<double> rational_at(const json& fraction, std::complex<double> q) {
  const auto polynomial = [&](const json& list) {
    std::complex<double> value = 0.0;
    for (std::size_t i = list.size(); i-- > 0;) {
      value = value * q + list[i].get<double>();
    }
    return value;
  };
  return polynomial(fraction["num_f"]) / polynomial(fraction["den_f"]);
}

/// Polynomial matrix of numbers as text ("A") or of fractions with denominator 1 ("B", "S").
PolynomialMatrix matrix_of(const json& rows, bool fractions) {
  PolynomialMatrix matrix;
  const auto size = static_cast<Eigen::Index>(rows.size());
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index j = 0; j < size; ++j) {
      const json& entry = rows[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
      const json& list = fractions ? entry["num"] : entry;
      for (std::size_t s = 0; s < list.size(); ++s) {
        if (matrix.size() <= s) {
          matrix.emplace_back(Eigen::MatrixXd::Zero(size, size));
        }
        matrix[s](i, j) = rational_text(list[s].get<std::string>());
      }
    }
  }
  return matrix;
}

TEST_F(Reference, GeneralMethod) {
  for (const json& g : data_["general_method"]) {
    const std::string name = g["name"];
    const int k = g["k"];
    const PolynomialMatrix a = matrix_of(g["A"], false);
    const trammel::filter::GeneralMethod method =
        name == "alpha_beta_exact"
            ? trammel::filter::GeneralMethod::from_operator(a, matrix_of(g["S"], true), k, g["T"])
            : trammel::filter::GeneralMethod::from_matrices(a, matrix_of(g["B"], true), k, g["T"]);
    const std::complex<double> q(0.3, 0.4);
    const Eigen::MatrixXcd x = method.inverse_characteristic(q);
    const Eigen::MatrixXcd c = method.characteristic(q);
    const Eigen::VectorXcd vector = method.vector_closure(q);
    const Eigen::VectorXcd scalar = method.scalar_closure(q);
    for (int i = 0; i < k; ++i) {
      const auto row = static_cast<std::size_t>(i);
      EXPECT_LE(std::abs(vector[i] - rational_at(g["closure_vector"][row], q)), 1e-12) << name;
      EXPECT_LE(std::abs(scalar[i] - rational_at(g["closure_scalar"][row], q)), 1e-12) << name;
      expect_near(method.vector_closure_response(10).row(i).transpose(),
                  vector_of(g["closure_vector_impulse"][row]), 1e-12, name);
      expect_near(method.scalar_closure_response(10).row(i).transpose(),
                  vector_of(g["closure_scalar_impulse"][row]), 1e-12, name);
      for (int j = 0; j < k; ++j) {
        const auto column = static_cast<std::size_t>(j);
        EXPECT_LE(std::abs(x(i, j) - rational_at(g["X"][row][column], q)), 1e-12) << name;
        EXPECT_LE(std::abs(c(i, j) - rational_at(g["C"][row][column], q)), 1e-12) << name;
      }
    }
    EXPECT_LE(std::abs(method.scalar_innovation(q) - rational_at(g["closure_scalar_innovation"], q)), 1e-12)
        << name;
    // The transfer functions as polynomials are the same functions of q.
    const auto expect_transfer = [&](const GeneralTransfer& transfer, const json& expected) {
      const auto at = [&](const Polynomial& p) {
        std::complex<double> value = 0.0;
        for (Eigen::Index s = p.size(); s-- > 0;) {
          value = value * q + p[s];
        }
        return value;
      };
      ASSERT_EQ(transfer.numerators.size(), expected.size());
      for (std::size_t row = 0; row < expected.size(); ++row) {
        EXPECT_LE(
            std::abs(at(transfer.numerators[row]) / at(transfer.denominator) - rational_at(expected[row], q)),
            1e-11)
            << name << " row " << row;
      }
    };
    if (method.has_vector_denominator()) {
      expect_transfer(method.vector_transfer(), g["closure_vector"]);
    }
    if (method.has_scalar_denominator()) {
      expect_transfer(method.scalar_transfer(), g["closure_scalar"]);
    }
  }
}

TEST_F(Reference, Predictor) {
  for (const json& e : data_["predictor_F0"]) {
    const auto f = predictor(e["v"], e["k"], 1.0);
    for (std::size_t i = 0; i < f.size(); ++i) {
      for (std::size_t j = 0; j < f.size(); ++j) {
        Eigen::VectorXd expected(static_cast<Eigen::Index>(e["F0"][i][j].size()));
        for (Eigen::Index s = 0; s < expected.size(); ++s) {
          expected[s] = rational_text(e["F0"][i][j][static_cast<std::size_t>(s)].get<std::string>());
        }
        expect_near(f[i][j], expected, 1e-12, "F0");
      }
    }
  }
}

}  // namespace
