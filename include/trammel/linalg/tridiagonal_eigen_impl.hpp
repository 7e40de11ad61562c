// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of tridiagonal_eigen.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Eigenvalues>

#include "trammel/linalg/panels.hpp"
#include "trammel/linalg/tridiagonal_eigen.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

namespace detail {

inline constexpr Eigen::Index kLeafSize = 40;  // at most this is left to the QL method
inline constexpr double kUnit = std::numeric_limits<double>::epsilon();

/// 1 + rho sum z_j^2 / (d_j - w), split at a pole: the parts left and right of it, with derivatives.
struct SecularValue {
  double left = 0.0;
  double left_slope = 0.0;
  double right = 0.0;
  double right_slope = 0.0;

  [[nodiscard]] double value() const { return 1.0 + left + right; }
  [[nodiscard]] double slope() const { return left_slope + right_slope; }
};

/// At `shift`, `distance` holding d_j - origin; the first `split` poles are the left part.
inline SecularValue secular(const Eigen::VectorXd& squares, const Eigen::Ref<Eigen::VectorXd>& distance,
                            double shift, Eigen::Index split, double rho) {
  const Eigen::Index right = squares.size() - split;
  const auto ratio = [&](Eigen::Index first, Eigen::Index count) {
    return squares.segment(first, count).array() / (distance.segment(first, count).array() - shift);
  };
  const auto slope = [&](Eigen::Index first, Eigen::Index count) {
    return squares.segment(first, count).array() / (distance.segment(first, count).array() - shift).square();
  };
  SecularValue result;
  result.left = rho * ratio(0, split).sum();
  result.left_slope = rho * slope(0, split).sum();
  result.right = rho * ratio(split, right).sum();
  result.right_slope = rho * slope(split, right).sum();
  return result;
}

/// The root near 0 of c + a / (p - x) + b / (q - x), given its value at 0, a + b's part in it, and c.
inline double two_pole_root(double c, double linear, double constant) {
  const double root = std::sqrt(std::max(linear * linear - 4.0 * c * constant, 0.0));
  return linear <= 0.0 ? (linear - root) / (2.0 * c) : 2.0 * constant / (linear + root);
}

}  // namespace detail

TRAMMEL_INLINE TridiagonalEigen::TridiagonalEigen(Eigen::Index size)
    : values_(size), off_diagonal_(size - 1), vectors_(size, size) {}

TRAMMEL_INLINE void TridiagonalEigen::compute(const Eigen::VectorXd& diagonal,
                                              const Eigen::VectorXd& off_diagonal, unsigned threads) {
  threads_ = threads;
  // The QL method takes off-diagonal entries for zero by a rule that supposes entries of size one.
  double scale = diagonal.cwiseAbs().maxCoeff();
  if (off_diagonal.size() > 0) {
    scale = std::max(scale, off_diagonal.cwiseAbs().maxCoeff());
  }
  if (!(scale > 0.0)) {
    scale = 1.0;
  }
  values_ = diagonal / scale;
  off_diagonal_ = off_diagonal / scale;
  vectors_.setZero();
  solve(0, values_.size());
  values_ *= scale;
}

TRAMMEL_INLINE void TridiagonalEigen::solve(Eigen::Index first, Eigen::Index size) {
  if (size <= detail::kLeafSize) {
    Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> leaf(size);
    leaf.computeFromTridiagonal(values_.segment(first, size), off_diagonal_.segment(first, size - 1));
    values_.segment(first, size) = leaf.eigenvalues();
    vectors_.block(first, first, size, size) = leaf.eigenvectors();
    return;
  }
  const Eigen::Index half = size / 2;
  const double coupling = off_diagonal_[first + half - 1];
  values_[first + half - 1] -= std::abs(coupling);
  values_[first + half] -= std::abs(coupling);
  solve(first, half);
  solve(first + half, size - half);
  merge(first, half, size, coupling);
}

TRAMMEL_INLINE void TridiagonalEigen::merge(Eigen::Index first, Eigen::Index half, Eigen::Index size,
                                            double coupling) {
  deflate(first, half, size, coupling);
  if (!poles_.empty()) {
    find_roots(2.0 * std::abs(coupling));
    exact_weights();
    make_vectors();
  }
  store(first, half, size);
}

/// Splits the poles into those kept and those that are eigenvalues already.
TRAMMEL_INLINE void TridiagonalEigen::deflate(Eigen::Index first, Eigen::Index half, Eigen::Index size,
                                              double coupling) {
  poles_.clear();
  deflated_.clear();
  std::vector<Pole> all(static_cast<std::size_t>(size));
  const double unit = std::sqrt(0.5);  // z has length one
  double largest = 0.0;
  for (Eigen::Index j = 0; j < size; ++j) {
    const bool upper = j < half;
    Pole& pole = all[static_cast<std::size_t>(j)];
    pole.value = values_[first + j];
    pole.weight = upper ? unit * vectors_(first + half - 1, first + j)
                        : std::copysign(unit, coupling) * vectors_(first + half, first + j);
    pole.column = first + j;
    pole.kind = upper ? Kind::kUpper : Kind::kLower;
    largest = std::max(largest, std::abs(pole.value));
  }
  std::stable_sort(all.begin(), all.end(), [](const Pole& a, const Pole& b) { return a.value < b.value; });
  const double rho = 2.0 * std::abs(coupling);
  constexpr double kRounding = 8.0;
  const double negligible = kRounding * detail::kUnit * std::max(largest, rho);
  Pole* last = nullptr;
  for (Pole& pole : all) {
    if (rho * std::abs(pole.weight) <= negligible) {
      deflated_.push_back(pole);
      continue;
    }
    if (last != nullptr) {
      // A rotation of the two takes the weight from the last one, at the price of this off-diagonal entry.
      const double weight = std::hypot(pole.weight, last->weight);
      const double c = pole.weight / weight;
      const double s = -last->weight / weight;
      if (std::abs((pole.value - last->value) * c * s) <= negligible) {
        auto x = vectors_.col(last->column).segment(first, size);
        auto y = vectors_.col(pole.column).segment(first, size);
        for (Eigen::Index i = 0; i < size; ++i) {
          const double turned = c * x[i] + s * y[i];
          y[i] = c * y[i] - s * x[i];
          x[i] = turned;
        }
        const double low = last->value * c * c + pole.value * s * s;
        pole.value = last->value * s * s + pole.value * c * c;
        last->value = low;
        if (last->kind != pole.kind) {
          pole.kind = Kind::kBoth;
        }
        pole.weight = weight;
        deflated_.push_back(*last);
      } else {
        poles_.push_back(*last);
      }
    }
    last = &pole;
  }
  if (last != nullptr) {
    poles_.push_back(*last);
  }
  const auto kept = static_cast<Eigen::Index>(poles_.size());
  pole_values_.resize(kept);
  squares_.resize(kept);
  for (Eigen::Index j = 0; j < kept; ++j) {
    const Pole& pole = poles_[static_cast<std::size_t>(j)];
    pole_values_[j] = pole.value;
    squares_[j] = pole.weight * pole.weight;
  }
}

TRAMMEL_INLINE void TridiagonalEigen::find_roots(double rho) {
  const Eigen::Index kept = squares_.size();
  roots_.resize(kept);
  inner_.resize(kept, kept);
  for_each_panel(kept, threads_, [&](Eigen::Index at, Eigen::Index width) {
    for (Eigen::Index i = at; i < at + width; ++i) {
      roots_[i] = find_root(i, rho, inner_.col(i));
    }
  });
}

/// Root number `index`, which lies right of that pole and left of the next; `distance` becomes d_j - root.
TRAMMEL_INLINE double TridiagonalEigen::find_root(Eigen::Index index, double rho,
                                                  Eigen::Ref<Eigen::VectorXd> distance) const {
  const Eigen::Index kept = squares_.size();
  if (kept == 1) {
    distance[0] = -rho * squares_[0];
    return pole_values_[0] - distance[0];
  }
  const bool last = index + 1 == kept;
  // The two poles that model the rest: those beside the root, the last two for the last root.
  const Eigen::Index p = last ? index - 1 : index;
  const Eigen::Index q = p + 1;
  const double width = last ? rho * squares_.sum() : pole_values_[index + 1] - pole_values_[index];
  // Distances are kept from the nearer pole, so that the one to the root is accurate.
  distance.array() = pole_values_.array() - pole_values_[index];
  Eigen::Index origin = index;
  double low = 0.0;
  double high = width;
  double shift = 0.5 * width;
  detail::SecularValue f = detail::secular(squares_, distance, shift, q, rho);
  const double at_middle = f.value();
  if (at_middle < 0.0 && !last) {
    origin = index + 1;
    distance.array() = pole_values_.array() - pole_values_[origin];
    low = -0.5 * width;
    high = 0.0;
    shift = -0.5 * width;
  } else if (at_middle < 0.0) {
    low = shift;
  } else {
    high = shift;
  }
  // First guess: both poles exact, all others as in the middle.
  {
    const double to_p = distance[p] - shift;
    const double to_q = distance[q] - shift;
    const double a = rho * squares_[p];
    const double b = rho * squares_[q];
    const double c = at_middle - a / to_p - b / to_q;
    const double guess = shift + detail::two_pole_root(c, c * (to_p + to_q) + a + b, at_middle * to_p * to_q);
    if (guess > low && guess < high) {
      shift = guess;
    }
  }
  constexpr int kMostSteps = 100;
  for (int step = 0; step < kMostSteps; ++step) {
    f = detail::secular(squares_, distance, shift, q, rho);
    const double value = f.value();
    constexpr double kRounding = 8.0;
    const double error = detail::kUnit * (kRounding * (1.0 + std::abs(f.left) + std::abs(f.right)) +
                                          std::abs(shift) * f.slope());
    if (std::abs(value) <= error) {
      break;
    }
    (value < 0.0 ? low : high) = shift;
    const double to_p = distance[p] - shift;
    const double to_q = distance[q] - shift;
    const double c = value - to_p * f.left_slope - to_q * f.right_slope;
    double next = shift + detail::two_pole_root(c, (to_p + to_q) * value - to_p * to_q * f.slope(),
                                                to_p * to_q * value);
    if (!(next > low && next < high)) {
      next = 0.5 * (low + high);
    }
    if (next == shift || !(next > low && next < high)) {
      break;
    }
    shift = next;
  }
  distance.array() -= shift;
  return pole_values_[origin] + shift;
}

/// The z whose roots are exactly those found.
TRAMMEL_INLINE void TridiagonalEigen::exact_weights() {
  const Eigen::Index kept = squares_.size();
  exact_.resize(kept);
  for_each_panel(kept, threads_, [&](Eigen::Index at, Eigen::Index width) {
    auto product = exact_.segment(at, width);
    product = inner_.diagonal().segment(at, width).cwiseAbs();
    for (Eigen::Index j = 0; j < kept; ++j) {
      for (Eigen::Index i = at; i < at + width; ++i) {
        if (i != j) {
          exact_[i] *= std::abs(inner_(i, j) / (pole_values_[i] - pole_values_[j]));
        }
      }
    }
  });
  for (Eigen::Index i = 0; i < kept; ++i) {
    exact_[i] = std::copysign(std::sqrt(exact_[i]), poles_[static_cast<std::size_t>(i)].weight);
  }
}

/// Eigenvectors of D + rho z z', rows ordered by kind.
TRAMMEL_INLINE void TridiagonalEigen::make_vectors() {
  const Eigen::Index kept = squares_.size();
  by_kind_.clear();
  for (const Kind kind : {Kind::kUpper, Kind::kBoth, Kind::kLower}) {
    for (Eigen::Index j = 0; j < kept; ++j) {
      if (poles_[static_cast<std::size_t>(j)].kind == kind) {
        by_kind_.push_back(j);
      }
    }
  }
  for_each_panel(kept, threads_, [&](Eigen::Index at, Eigen::Index width) {
    Eigen::VectorXd vector(kept);
    for (Eigen::Index i = at; i < at + width; ++i) {
      vector = exact_.cwiseQuotient(inner_.col(i));
      vector /= vector.norm();
      for (Eigen::Index j = 0; j < kept; ++j) {
        inner_(j, i) = vector[by_kind_[static_cast<std::size_t>(j)]];
      }
    }
  });
}

/// Multiplies the halves' eigenvectors by those found and sorts what comes out.
TRAMMEL_INLINE void TridiagonalEigen::store(Eigen::Index first, Eigen::Index half, Eigen::Index size) {
  const auto kept = static_cast<Eigen::Index>(poles_.size());
  const auto count = [this](Kind kind) {
    return static_cast<Eigen::Index>(
        std::count_if(poles_.begin(), poles_.end(), [kind](const Pole& pole) { return pole.kind == kind; }));
  };
  const Eigen::Index upper = kept > 0 ? count(Kind::kUpper) : 0;
  const Eigen::Index lower = kept > 0 ? count(Kind::kLower) : 0;
  product_.resize(size, size);
  if (kept > 0) {
    // The lower half of the columns that have none is never read, nor is the upper of the others.
    gather_.resize(size, kept);
    for (Eigen::Index j = 0; j < kept; ++j) {
      const Pole& pole = poles_[static_cast<std::size_t>(by_kind_[static_cast<std::size_t>(j)])];
      gather_.col(j) = vectors_.col(pole.column).segment(first, size);
    }
    const auto above = gather_.topLeftCorner(half, kept - lower);
    const auto below = gather_.bottomRightCorner(size - half, kept - upper);
    for_each_panel(kept, threads_, [&](Eigen::Index at, Eigen::Index width) {
      const auto columns = inner_.middleCols(at, width);
      product_.block(0, at, half, width).noalias() = above * columns.topRows(kept - lower);
      product_.block(half, at, size - half, width).noalias() = below * columns.bottomRows(kept - upper);
    });
  }
  Eigen::Index filled = kept;
  std::vector<std::pair<double, Eigen::Index>> order;
  for (Eigen::Index i = 0; i < kept; ++i) {
    order.emplace_back(roots_[i], i);
  }
  for (const Pole& pole : deflated_) {
    product_.col(filled) = vectors_.col(pole.column).segment(first, size);
    order.emplace_back(pole.value, filled++);
  }
  std::stable_sort(order.begin(), order.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  for (Eigen::Index i = 0; i < size; ++i) {
    values_[first + i] = order[static_cast<std::size_t>(i)].first;
    vectors_.col(first + i).segment(first, size) = product_.col(order[static_cast<std::size_t>(i)].second);
  }
}

}  // namespace trammel::inline TRAMMEL_ABI::linalg
