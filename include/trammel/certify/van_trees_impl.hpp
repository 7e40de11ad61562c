// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of van_trees.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <vector>

#include "trammel/certify/scalar_priors.hpp"
#include "trammel/certify/van_trees.hpp"
#include "trammel/linalg/cholesky.hpp"
#include "trammel/linalg/svd.hpp"
#include "trammel/linalg/symmetric_eigen.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

namespace van_trees_detail {

/// Share given away for rounding errors.
inline constexpr double kRounding = 1e-9;
inline constexpr int kBoxIterations = 60;
/// Small problems can afford to wait for widths that converge slowly.
inline constexpr int kSmallBoxIterations = 400;
inline constexpr Eigen::Index kSmallSize = 40;
inline constexpr int kBallIterations = 12;
/// Iterations of the widths while groups are compared; the widths start from those before the merger.
inline constexpr int kGroupIterations = 4;
/// Pairs of neighbours tried in each round, most coherent first; all of them for few blocks.
inline constexpr std::size_t kCandidates = 8;
inline constexpr Eigen::Index kFewBlocks = 24;
/// Rounds without a better bound after which merging ends.
inline constexpr int kPatience = 6;
/// Squared half-widths below this are as good as zero.
inline constexpr double kSmallestSquare = 1e-14;

/// tr S (J + D)^-1 and X = (J + D)^-1 C', S = C'C, of which X X' is the sensitivity of the value to -D; value
/// 0 if J + D is not positive definite.
struct Evaluation {
  double value = 0.0;
  Eigen::MatrixXd half;
};

inline Evaluation evaluate(const Eigen::MatrixXd& information, const Eigen::MatrixXd& output,
                           const Eigen::MatrixXd& added) {
  Evaluation result;
  const linalg::Cholesky cholesky(information + added);
  if (cholesky.info() != Eigen::Success) {
    return result;
  }
  result.half = output.transpose();
  cholesky.matrixL().solveInPlace(result.half);
  result.value = result.half.squaredNorm();
  cholesky.matrixU().solveInPlace(result.half);
  return result;
}

/// A problem in independent coordinates: coordinates [offset[g], offset[g + 1]) share the budget
/// sum w^2 = 1; the rest (free ones) have no prior.
struct Boxes {
  Eigen::MatrixXd information;
  Eigen::MatrixXd output;
  std::vector<Eigen::Index> offset;
  Eigen::VectorXd square;  ///< w^2 of the bounded coordinates, the start of the iteration
};

struct BoxResult {
  double value = 0.0;
  Eigen::VectorXd square;  ///< the best widths
};

inline Eigen::VectorXd equal_squares(const std::vector<Eigen::Index>& offset) {
  Eigen::VectorXd square(offset.back());
  for (std::size_t g = 0; g + 1 < offset.size(); ++g) {
    const Eigen::Index count = offset[g + 1] - offset[g];
    square.segment(offset[g], count).setConstant(1.0 / static_cast<double>(count));
  }
  return square;
}

/// Any widths give a valid bound: the best of the iteration is kept.
inline BoxResult optimise_boxes(const Boxes& boxes, int iterations) {
  BoxResult best;
  Eigen::VectorXd square = boxes.square;
  best.square = square;
  const Eigen::Index bounded = boxes.offset.back();
  for (int iteration = 0; iteration < iterations; ++iteration) {
    Eigen::VectorXd added = Eigen::VectorXd::Zero(boxes.information.rows());
    for (Eigen::Index j = 0; j < bounded; ++j) {
      added(j) =
          interval_information(boxes.information(j, j), std::sqrt(std::max(square(j), kSmallestSquare)));
    }
    const Evaluation evaluation = evaluate(boxes.information, boxes.output, added.asDiagonal());
    if (evaluation.value > best.value) {
      best.value = evaluation.value;
      best.square = square;
    }
    if (evaluation.half.size() == 0) {
      break;
    }
    const Eigen::VectorXd sensitivity = evaluation.half.rowwise().squaredNorm();
    for (std::size_t g = 0; g + 1 < boxes.offset.size(); ++g) {
      const Eigen::Index first = boxes.offset[g];
      const Eigen::Index count = boxes.offset[g + 1] - first;
      const Eigen::VectorXd wanted =
          (sensitivity.segment(first, count).array() * added.segment(first, count).array() *
           square.segment(first, count).array())
              .sqrt();
      if (wanted.sum() > 0.0) {
        // Rounded down so that the widths stay in the ball.
        square.segment(first, count) =
            (1.0 - 1e-14) * (square.segment(first, count) + wanted / wanted.sum()) / 2.0;
      }
    }
  }
  return best;
}

/// Columns of the direction of each group: block l of group g has rows turn[l], all blocks of a group share
/// the coordinates.
struct Grouping {
  std::vector<std::vector<Eigen::Index>> groups;
  std::vector<Eigen::MatrixXd> turn;  ///< Q_l of every block
};

inline Boxes make_boxes(const UnitBalls& balls, const Grouping& grouping) {
  Boxes boxes;
  boxes.offset.push_back(0);
  for (const auto& group : grouping.groups) {
    boxes.offset.push_back(boxes.offset.back() + balls.block_size(group.front()));
  }
  const Eigen::Index bounded = boxes.offset.back();
  const Eigen::Index free = balls.size() - balls.offset.back();
  Eigen::MatrixXd directions = Eigen::MatrixXd::Zero(balls.size(), bounded + free);
  directions.bottomRightCorner(free, free).setIdentity();
  for (std::size_t g = 0; g < grouping.groups.size(); ++g) {
    const Eigen::Index count = boxes.offset[g + 1] - boxes.offset[g];
    auto columns = directions.middleCols(boxes.offset[g], count);
    for (const Eigen::Index l : grouping.groups[g]) {
      columns.middleRows(balls.begin(l), count) = grouping.turn[static_cast<std::size_t>(l)];
    }
    const linalg::SymmetricEigen eigen(columns.transpose() * balls.prior * columns);
    columns = (columns * eigen.eigenvectors()).eval();
  }
  boxes.information = directions.transpose() * balls.information * directions;
  boxes.output = balls.output * directions;
  boxes.square = equal_squares(boxes.offset);
  return boxes;
}

inline Grouping single_blocks(const UnitBalls& balls) {
  Grouping grouping;
  for (Eigen::Index l = 0; l < balls.blocks(); ++l) {
    grouping.groups.push_back({l});
    grouping.turn.push_back(Eigen::MatrixXd::Identity(balls.block_size(l), balls.block_size(l)));
  }
  return grouping;
}

/// Two neighbouring groups that could become one.
struct Merger {
  std::size_t first = 0;
  double coherence = 0.0;  ///< mean correlation of the two groups after the turn
  Eigen::MatrixXd turn;    ///< orthogonal, aligns the second group with the first
};

/// Both ways to align: axis by axis with signs, and by the polar factor of the cross covariance.
inline std::vector<Merger> list_mergers(const UnitBalls& balls, const Grouping& grouping) {
  std::vector<Merger> mergers;
  for (std::size_t g = 0; g + 1 < grouping.groups.size(); ++g) {
    const auto& left = grouping.groups[g];
    const auto& right = grouping.groups[g + 1];
    const Eigen::Index size = balls.block_size(left.front());
    if (size != balls.block_size(right.front())) {
      continue;
    }
    Eigen::MatrixXd cross = Eigen::MatrixXd::Zero(size, size);
    for (const Eigen::Index l : left) {
      for (const Eigen::Index m : right) {
        cross += grouping.turn[static_cast<std::size_t>(m)].transpose() *
                 balls.prior.block(balls.begin(m), balls.begin(l), size, size) *
                 grouping.turn[static_cast<std::size_t>(l)];
      }
    }
    cross /= static_cast<double>(left.size() * right.size());
    const Eigen::VectorXd signs = cross.diagonal().unaryExpr([](double x) { return x < 0.0 ? -1.0 : 1.0; });
    mergers.push_back({g, cross.diagonal().cwiseAbs().sum(), signs.asDiagonal()});
    const linalg::Svd svd(cross, Eigen::ComputeFullU | Eigen::ComputeFullV);
    mergers.push_back({g, svd.singularValues().sum(), svd.matrixU() * svd.matrixV().transpose()});
  }
  std::stable_sort(mergers.begin(), mergers.end(),
                   [](const Merger& a, const Merger& b) { return a.coherence > b.coherence; });
  return mergers;
}

inline Grouping merge(const Grouping& grouping, const Merger& merger) {
  Grouping merged = grouping;
  auto& left = merged.groups[merger.first];
  const auto& right = grouping.groups[merger.first + 1];
  for (const Eigen::Index m : right) {
    Eigen::MatrixXd& turn = merged.turn[static_cast<std::size_t>(m)];
    turn = (turn * merger.turn).eval();
    left.push_back(m);
  }
  merged.groups.erase(merged.groups.begin() + static_cast<std::ptrdiff_t>(merger.first) + 1);
  return merged;
}

/// Widths of the groups after a merger, from those before: the mean of the two.
inline Eigen::VectorXd merged_squares(const Eigen::VectorXd& square, const std::vector<Eigen::Index>& offset,
                                      std::size_t first) {
  const Eigen::Index count = offset[first + 1] - offset[first];
  Eigen::VectorXd result(square.size() - count);
  result << square.head(offset[first]),
      (square.segment(offset[first], count) + square.segment(offset[first + 1], count)) / 2.0,
      square.tail(square.size() - offset[first + 2]);
  return result;
}

}  // namespace van_trees_detail

TRAMMEL_INLINE double box_bound(const UnitBalls& balls) {
  using namespace van_trees_detail;
  return (1.0 - kRounding) * optimise_boxes(make_boxes(balls, single_blocks(balls)),
                                            balls.size() <= kSmallSize ? kSmallBoxIterations : kBoxIterations)
                                 .value;
}

TRAMMEL_INLINE double ball_bound(const UnitBalls& balls) {
  using namespace van_trees_detail;
  std::map<Eigen::Index, std::vector<BallPrior>> tables;
  for (Eigen::Index l = 0; l < balls.blocks(); ++l) {
    auto& table = tables[balls.block_size(l)];
    if (table.empty()) {
      table = ball_priors(balls.block_size(l));
    }
  }
  std::vector<BallPrior> chosen;
  for (Eigen::Index l = 0; l < balls.blocks(); ++l) {
    chosen.push_back(tables[balls.block_size(l)].back());
  }
  double best = 0.0;
  for (int iteration = 0; iteration < kBallIterations; ++iteration) {
    Eigen::MatrixXd added = Eigen::MatrixXd::Zero(balls.size(), balls.size());
    for (Eigen::Index l = 0; l < balls.blocks(); ++l) {
      const Eigen::Index first = balls.begin(l);
      const Eigen::Index count = balls.block_size(l);
      const BallPrior& prior = chosen[static_cast<std::size_t>(l)];
      added.block(first, first, count, count) =
          (prior.tau - 1.0) * balls.information.block(first, first, count, count) +
          prior.k * Eigen::MatrixXd::Identity(count, count);
    }
    const Evaluation evaluation = evaluate(balls.information, balls.output, added);
    if (!(evaluation.value > best * (1.0 + kRounding))) {
      break;
    }
    best = evaluation.value;
    for (Eigen::Index l = 0; l < balls.blocks(); ++l) {
      const Eigen::Index first = balls.begin(l);
      const Eigen::Index count = balls.block_size(l);
      const auto rows = evaluation.half.middleRows(first, count);
      const Eigen::MatrixXd weight = rows * rows.transpose();
      const double per_tau = weight.cwiseProduct(balls.information.block(first, first, count, count)).sum();
      const double per_k = weight.trace();
      const auto& table = tables[count];
      chosen[static_cast<std::size_t>(l)] =
          *std::min_element(table.begin(), table.end(), [&](const BallPrior& a, const BallPrior& b) {
            return a.tau * per_tau + a.k * per_k < b.tau * per_tau + b.k * per_k;
          });
    }
  }
  return (1.0 - kRounding) * best;
}

TRAMMEL_INLINE double group_bound(const UnitBalls& balls, Eigen::Index most_blocks) {
  using namespace van_trees_detail;
  if (balls.blocks() < 2 || balls.blocks() > most_blocks) {
    return 0.0;
  }
  Grouping grouping = single_blocks(balls);
  Boxes boxes = make_boxes(balls, grouping);
  BoxResult current = optimise_boxes(boxes, kBoxIterations);
  double best = 0.0;
  int without_progress = 0;
  while (grouping.groups.size() > 1 && without_progress < kPatience) {
    std::vector<Merger> mergers = list_mergers(balls, grouping);
    if (balls.blocks() > kFewBlocks && mergers.size() > kCandidates) {
      mergers.resize(kCandidates);
    }
    if (mergers.empty()) {
      break;
    }
    BoxResult next;
    Grouping next_grouping;
    std::vector<Eigen::Index> next_offset;
    for (const Merger& merger : mergers) {
      Grouping trial = merge(grouping, merger);
      Boxes trial_boxes = make_boxes(balls, trial);
      trial_boxes.square = merged_squares(current.square, boxes.offset, merger.first);
      BoxResult result = optimise_boxes(trial_boxes, kGroupIterations);
      if (result.value > next.value) {
        next = std::move(result);
        next_grouping = std::move(trial);
        next_offset = trial_boxes.offset;
      }
    }
    if (next.value <= 0.0) {
      break;
    }
    grouping = std::move(next_grouping);
    boxes.offset = next_offset;
    current = next;
    without_progress = current.value > best ? 0 : without_progress + 1;
    best = std::max(best, current.value);
  }
  return (1.0 - kRounding) * best;
}

}  // namespace trammel::inline TRAMMEL_ABI::certify
