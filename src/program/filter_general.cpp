// SPDX-License-Identifier: Apache-2.0
#include "filter_general.hpp"

#include <algorithm>
#include <complex>
#include <optional>
#include <utility>

#include "trammel/core/config.hpp"
#include "trammel/filter/polynomial.hpp"

namespace trammel::program {

namespace {

using io::Json;

/// Rows of entries, each a list of the first coefficients in ascending powers of z^-1.
Json series_json(const filter::PolynomialMatrix& series, int terms) {
  Json rows = Json::array();
  const std::size_t count = std::min(series.size(), static_cast<std::size_t>(terms));
  for (Eigen::Index i = 0; i < series[0].rows(); ++i) {
    Json row = Json::array();
    for (Eigen::Index j = 0; j < series[0].cols(); ++j) {
      Json entry = Json::array();
      for (std::size_t s = 0; s < count; ++s) {
        entry.push_back(io::to_json(series[s](i, j)));
      }
      row.push_back(std::move(entry));
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

/// Transfer functions, poles and stability; null where the closure has no polynomial denominator.
Json closure_json(const std::optional<filter::GeneralTransfer>& transfer, const Eigen::MatrixXd& response) {
  Json json = {{"denominator", nullptr}, {"numerators", nullptr}, {"poles", nullptr}, {"stable", nullptr}};
  if (transfer) {
    Json numerators = Json::array();
    for (const filter::Polynomial& numerator : transfer->numerators) {
      numerators.push_back(io::to_json(numerator));
    }
    Json poles = Json::array();
    for (const std::complex<double> pole : filter::poles(transfer->denominator)) {
      poles.push_back(Json::array({pole.real(), pole.imag()}));
    }
    json = {{"denominator", io::to_json(transfer->denominator)},
            {"numerators", numerators},
            {"poles", poles},
            {"stable", filter::is_stable(filter::reflect(transfer->denominator))}};
  }
  json["impulse"] = io::matrix_to_json(response);
  return json;
}

}  // namespace

Json general_filter_json(const io::GeneralFilterFile& file, const filter::GeneralMethod& method) {
  const int terms = file.samples;
  const filter::PolynomialMatrix inverse = method.inverse_characteristic_series(terms);
  const auto vector =
      method.has_vector_denominator() ? std::optional(method.vector_transfer()) : std::nullopt;
  const auto scalar =
      method.has_scalar_denominator() ? std::optional(method.scalar_transfer()) : std::nullopt;
  return {{"order", file.order},
          {"rows", file.a[0].rows()},
          {"sampling_s", file.sampling_s},
          {"given", file.operator_given ? "S" : "B"},
          {"commutes", file.operator_given ? Json(nullptr) : Json(method.commutes())},
          {"A", series_json(file.a, terms)},
          {"B", series_json(method.estimate_accuracy_series(terms), terms)},
          {"C", series_json(filter::invert_series(inverse, terms), terms)},
          {"C_inverse", series_json(inverse, terms)},
          {"S", series_json(method.residual_operator_series(terms), terms)},
          {"vector", closure_json(vector, method.vector_closure_response(terms))},
          {"scalar", closure_json(scalar, method.scalar_closure_response(terms))},
          {"library_version", kVersion}};
}

}  // namespace trammel::program
