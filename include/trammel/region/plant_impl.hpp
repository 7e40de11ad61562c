// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of plant.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "trammel/core/error.hpp"
#include "trammel/linalg/lu.hpp"
#include "trammel/linalg/svd.hpp"
#include "trammel/region/plant.hpp"

namespace trammel::inline TRAMMEL_ABI::region {

namespace detail {

/// Calls visit(is_a, index, value) for every coefficient in the order of p; index is that of the
/// coefficient (1 for a_1, l for the first b).
template <class Model, class Visitor>
void for_each_coefficient(Model& model, Visitor&& visit) {
  int index = 1;
  for (auto& value : model.a) {
    visit(true, index++, value);
  }
  index = model.delay;
  for (auto& value : model.b) {
    visit(false, index++, value);
  }
}

}  // namespace detail

TRAMMEL_INLINE void validate(const Plant& plant) {
  require(plant.delay >= 1, [&] {
    return ErrorDetail{"plant.delay", std::to_string(plant.delay), "at least 1"};
  });
  require(plant.b.size() >= 1, "plant.b", "no coefficient", "at least one");
  require(plant.a.allFinite(), "plant.a", "a value that is not finite", "finite numbers");
  require(plant.b.allFinite(), "plant.b", "a value that is not finite", "finite numbers");
}

TRAMMEL_INLINE void validate(const PlantModel& model) {
  require(model.delay >= 1, [&] {
    return ErrorDetail{"plant.delay", std::to_string(model.delay), "at least 1"};
  });
  require(!model.b.empty(), "plant.b", "no coefficient", "at least one");
  detail::for_each_coefficient(model, [](bool is_a, int index, const std::optional<double>& value) {
    require(!value || std::isfinite(*value), [&] {
      return ErrorDetail{(is_a ? "plant.a" : "plant.b") + std::to_string(index), "a value that is not finite",
                         "a finite number"};
    });
  });
  require(unknown_count(model) >= 1, "plant", "all coefficients known", "at least one unknown coefficient");
}

TRAMMEL_INLINE Eigen::Index unknown_count(const PlantModel& model) {
  const auto unknown = [](const std::optional<double>& value) { return !value; };
  return std::count_if(model.a.begin(), model.a.end(), unknown) +
         std::count_if(model.b.begin(), model.b.end(), unknown);
}

TRAMMEL_INLINE std::vector<std::string> unknown_names(const PlantModel& model) {
  std::vector<std::string> names;
  detail::for_each_coefficient(model, [&](bool is_a, int index, const std::optional<double>& value) {
    if (!value) {
      names.push_back((is_a ? "a" : "b") + std::to_string(index));
    }
  });
  return names;
}

TRAMMEL_INLINE Plant complete(const PlantModel& model, const Eigen::VectorXd& p) {
  require(p.size() == unknown_count(model), [&] {
    return ErrorDetail{"complete: p", std::to_string(p.size()) + " numbers",
                       std::to_string(unknown_count(model))};
  });
  Plant plant;
  plant.delay = model.delay;
  plant.a.resize(static_cast<Eigen::Index>(model.a.size()));
  plant.b.resize(static_cast<Eigen::Index>(model.b.size()));
  Eigen::Index next = 0;
  detail::for_each_coefficient(model, [&](bool is_a, int index, const std::optional<double>& value) {
    (is_a ? plant.a(index - 1) : plant.b(index - model.delay)) = value ? *value : p(next++);
  });
  return plant;
}

TRAMMEL_INLINE Eigen::VectorXd unknown_of(const PlantModel& model, const Plant& plant) {
  require(plant.a.size() == static_cast<Eigen::Index>(model.a.size()) &&
              plant.b.size() == static_cast<Eigen::Index>(model.b.size()) && plant.delay == model.delay,
          "unknown_of: plant", "other orders or delay", "those of the model");
  Eigen::VectorXd p(unknown_count(model));
  Eigen::Index next = 0;
  detail::for_each_coefficient(model, [&](bool is_a, int index, const std::optional<double>& value) {
    if (!value) {
      p(next++) = is_a ? plant.a(index - 1) : plant.b(index - model.delay);
    }
  });
  return p;
}

TRAMMEL_INLINE Eigen::VectorXd impulse_parameters(const Plant& plant, int size) {
  validate(plant);
  require(size >= 1, [&] {
    return ErrorDetail{"impulse_parameters: size", std::to_string(size), "at least 1"};
  });
  Eigen::VectorXd theta(size);
  for (Eigen::Index i = 0; i < size; ++i) {
    double value = i < plant.b.size() ? plant.b(i) : 0.0;
    for (Eigen::Index j = 1; j <= std::min(i, plant.a.size()); ++j) {
      value -= plant.a(j - 1) * theta(i - j);
    }
    theta(i) = value;
  }
  return theta;
}

TRAMMEL_INLINE PlantFromImpulse plant_from_impulse(const PlantModel& model, const Eigen::VectorXd& theta) {
  validate(model);
  const Eigen::Index unknowns = unknown_count(model);
  const Eigen::Index rows = theta.size();
  require(rows >= unknowns, [&] {
    return ErrorDetail{"plant_from_impulse: theta", std::to_string(rows) + " numbers",
                       "at least as many as unknown coefficients, " + std::to_string(unknowns)};
  });
  Eigen::MatrixXd equations = Eigen::MatrixXd::Zero(rows, unknowns);
  Eigen::VectorXd right = -theta;
  Eigen::Index column = 0;
  detail::for_each_coefficient(model, [&](bool is_a, int index, const std::optional<double>& value) {
    for (Eigen::Index i = 0; i < rows; ++i) {
      double factor = 0.0;
      if (is_a) {
        factor = i >= index ? theta(i - index) : 0.0;
      } else {
        factor = i == index - model.delay ? -1.0 : 0.0;
      }
      if (value) {
        right(i) -= factor * *value;
      } else {
        equations(i, column) = factor;
      }
    }
    column += value ? 0 : 1;
  });

  PlantFromImpulse result;
  result.determinant = std::numeric_limits<double>::quiet_NaN();
  if (rows == unknowns) {
    result.determinant = linalg::Lu(equations).determinant();
  }
  const linalg::Svd svd(equations, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const double largest = svd.singularValues()(0);
  const double smallest = svd.singularValues()(unknowns - 1);
  const double kSingular = static_cast<double>(rows) * std::numeric_limits<double>::epsilon();
  if (!(smallest > kSingular * largest)) {
    result.condition = std::numeric_limits<double>::infinity();
    result.parameters.setConstant(unknowns, std::numeric_limits<double>::quiet_NaN());
    return result;
  }
  result.condition = largest / smallest;
  result.parameters = svd.solve(right);
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI::region
