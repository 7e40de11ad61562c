// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of model.hpp.
#pragma once

#include <algorithm>
#include <map>
#include <numeric>
#include <tuple>
#include <utility>

#include "trammel/sdp/detail/model.hpp"

namespace trammel::inline TRAMMEL_ABI::sdp::detail {

/// Sets of rows connected by off-diagonal coefficients.
class Components {
 public:
  explicit Components(int size) : parent_(static_cast<std::size_t>(size)) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }
  int find(int row) {
    while (parent_[at(row)] != row) {
      parent_[at(row)] = parent_[at(parent_[at(row)])];
      row = parent_[at(row)];
    }
    return row;
  }
  void join(int a, int b) {
    const int root_a = find(a);
    const int root_b = find(b);
    parent_[at(std::max(root_a, root_b))] = std::min(root_a, root_b);  // the first row names its component
  }

 private:
  static std::size_t at(int row) { return static_cast<std::size_t>(row); }
  std::vector<int> parent_;
};

template <class Item, class Key>
void sort_and_sum(std::vector<Item>& items, Key&& key) {
  std::stable_sort(items.begin(), items.end(), [&](const Item& a, const Item& b) { return key(a) < key(b); });
  std::size_t kept = 0;
  for (std::size_t k = 0; k < items.size(); ++k) {
    if (kept > 0 && key(items[kept - 1]) == key(items[k])) {
      items[kept - 1].value += items[k].value;
    } else {
      items[kept++] = items[k];
    }
  }
  items.resize(kept);
  std::erase_if(items, [](const Item& item) { return item.value == 0.0; });
}

/// Builds a Model step by step; `reduce` names the steps.
class Reducer {
 public:
  explicit Reducer(const Problem& problem) : problem_(problem) { model_.cost = problem.cost; }

  void place_rows() {
    std::vector<Components> components;
    std::vector<std::vector<char>> present;
    for (const Block& block : problem_.blocks) {
      components.emplace_back(block.size);
      present.emplace_back(static_cast<std::size_t>(block.size), char{0});
      model_.places.emplace_back(static_cast<std::size_t>(block.size));
    }
    for (const Entry& entry : problem_.entries) {
      if (entry.value != 0.0) {
        const auto b = static_cast<std::size_t>(entry.block);
        components[b].join(entry.row, entry.column);
        present[b][static_cast<std::size_t>(entry.row)] = 1;
        present[b][static_cast<std::size_t>(entry.column)] = 1;
      }
    }
    for (const LowRankTerm& term : problem_.low_rank) {
      join_support(term, components[static_cast<std::size_t>(term.block)],
                   present[static_cast<std::size_t>(term.block)]);
    }
    for (std::size_t b = 0; b < problem_.blocks.size(); ++b) {
      place_block(b, components[b], present[b]);
    }
  }

  void copy_coefficients() {
    for (const Entry& entry : problem_.entries) {
      if (entry.value != 0.0) {
        copy(entry);
      }
    }
    for (const LowRankTerm& term : problem_.low_rank) {
      copy(term);
    }
    for (DenseData& part : model_.dense) {
      sort_and_sum(part.entries, [](const Entry& e) { return std::tuple(e.variable, e.column, e.row); });
    }
    const auto by_row = [](const DiagonalEntry& e) { return std::pair(e.row, e.variable); };
    sort_and_sum(model_.diagonal.entries, by_row);
    sort_and_sum(model_.equations.entries, by_row);
  }

  /// Finds pairs of opposite rows and moves them to the equations.
  void pair_opposite_rows() {
    using Row = std::vector<std::pair<int, double>>;
    std::vector<Row> rows(static_cast<std::size_t>(model_.diagonal.size));
    for (const DiagonalEntry& e : model_.diagonal.entries) {
      rows[static_cast<std::size_t>(e.row)].emplace_back(e.variable, e.value);
    }
    std::map<Row, std::vector<int>> waiting;
    std::vector<Place> moved(rows.size());
    for (std::size_t r = 0; r < rows.size(); ++r) {
      Row opposite = rows[r];
      for (auto& [variable, value] : opposite) {
        value = -value;
      }
      const auto found = waiting.find(opposite);
      const bool has_variable = !rows[r].empty() && rows[r].back().first != kConstant;
      if (!has_variable || found == waiting.end() || found->second.empty()) {
        waiting[rows[r]].push_back(static_cast<int>(r));
        continue;
      }
      const auto partner = static_cast<std::size_t>(found->second.back());
      found->second.pop_back();
      const int equation = model_.equations.size++;
      for (const auto& [variable, value] : rows[partner]) {
        model_.equations.entries.push_back({variable, equation, value});
      }
      moved[partner] = {Place::Kind::kFreePositive, 0, equation};
      moved[r] = {Place::Kind::kFreeNegated, 0, equation};
    }
    renumber_diagonal(moved);
  }

  [[nodiscard]] Model take() { return std::move(model_); }

 private:
  static void join_support(const LowRankTerm& term, Components& components, std::vector<char>& present) {
    int first = -1;
    for (int row = 0; row < term.vectors.rows(); ++row) {
      if (!term.vectors.row(row).isZero(0.0)) {
        first = first < 0 ? row : first;
        components.join(first, row);
        present[static_cast<std::size_t>(row)] = 1;
      }
    }
  }

  void place_block(std::size_t b, Components& components, const std::vector<char>& present) {
    const Block& block = problem_.blocks[b];
    const auto size = static_cast<std::size_t>(block.size);
    std::vector<int> count(size, 0);
    for (int row = 0; row < block.size; ++row) {
      ++count[static_cast<std::size_t>(components.find(row))];
    }
    std::vector<int> part(size, -1);
    for (int row = 0; row < block.size; ++row) {
      Place& place = model_.places[b][static_cast<std::size_t>(row)];
      const auto root = static_cast<std::size_t>(components.find(row));
      if (present[static_cast<std::size_t>(row)] == 0) {
        continue;
      }
      if (block.kind == BlockKind::kFree) {
        place = {Place::Kind::kFree, 0, model_.equations.size++};
      } else if (block.kind == BlockKind::kDiagonal || count[root] == 1) {
        place = {Place::Kind::kDiagonal, 0, model_.diagonal.size++};
      } else {
        if (part[root] < 0) {
          part[root] = static_cast<int>(model_.dense.size());
          model_.dense.emplace_back();
        }
        place = {Place::Kind::kDense, part[root], model_.dense[static_cast<std::size_t>(part[root])].size++};
      }
    }
  }

  [[nodiscard]] const Place& place_of(int block, int row) const {
    return model_.places[static_cast<std::size_t>(block)][static_cast<std::size_t>(row)];
  }

  void copy(const Entry& entry) {
    const Place& place = place_of(entry.block, entry.row);
    if (place.kind == Place::Kind::kDense) {
      const int other = place_of(entry.block, entry.column).row;
      model_.dense[static_cast<std::size_t>(place.part)].entries.push_back(
          {entry.variable, place.part, std::min(place.row, other), std::max(place.row, other), entry.value});
    } else {
      DiagonalData& data = place.kind == Place::Kind::kFree ? model_.equations : model_.diagonal;
      data.entries.push_back({entry.variable, place.row, entry.value});
    }
  }

  void copy(const LowRankTerm& term) {
    int part = -1;
    for (int row = 0; row < term.vectors.rows(); ++row) {
      if (term.vectors.row(row).isZero(0.0)) {
        continue;
      }
      const Place& place = place_of(term.block, row);
      if (place.kind == Place::Kind::kDiagonal) {
        const double value =
            (term.vectors.row(row).array().square() * term.weights.transpose().array()).sum();
        model_.diagonal.entries.push_back({term.variable, place.row, value});
        return;
      }
      DenseData& data = model_.dense[static_cast<std::size_t>(place.part)];
      if (part < 0) {
        part = place.part;
        data.low_rank.push_back(
            {term.variable, part, Eigen::MatrixXd::Zero(data.size, term.vectors.cols()), term.weights});
      }
      data.low_rank.back().vectors.row(place.row) = term.vectors.row(row);
    }
  }

  void renumber_diagonal(const std::vector<Place>& moved) {
    std::vector<int> renumbered(moved.size(), -1);
    int size = 0;
    for (std::size_t r = 0; r < moved.size(); ++r) {
      if (moved[r].kind == Place::Kind::kAbsent) {
        renumbered[r] = size++;
      }
    }
    for (std::vector<Place>& block : model_.places) {
      for (Place& place : block) {
        if (place.kind == Place::Kind::kDiagonal) {
          const auto r = static_cast<std::size_t>(place.row);
          place = renumbered[r] < 0 ? moved[r] : Place{Place::Kind::kDiagonal, 0, renumbered[r]};
        }
      }
    }
    DiagonalData kept{size, {}};
    for (const DiagonalEntry& e : model_.diagonal.entries) {
      const int row = renumbered[static_cast<std::size_t>(e.row)];
      if (row >= 0) {
        kept.entries.push_back({e.variable, row, e.value});
      }
    }
    model_.diagonal = std::move(kept);
  }

  const Problem& problem_;
  Model model_;
};

TRAMMEL_INLINE Model reduce(const Problem& problem) {
  Reducer reducer(problem);
  reducer.place_rows();
  reducer.copy_coefficients();
  reducer.pair_opposite_rows();
  return reducer.take();
}

TRAMMEL_INLINE BlockMatrix expand(const Problem& problem, const Model& model, const Parts& parts) {
  BlockMatrix blocks;
  for (std::size_t b = 0; b < problem.blocks.size(); ++b) {
    const Block& block = problem.blocks[b];
    const bool dense = block.kind == BlockKind::kDense;
    Eigen::MatrixXd value = Eigen::MatrixXd::Zero(block.size, dense ? block.size : 1);
    const std::vector<Place>& places = model.places[b];
    for (int row = 0; row < block.size; ++row) {
      const Place& place = places[static_cast<std::size_t>(row)];
      const int column = dense ? row : 0;
      switch (place.kind) {
        case Place::Kind::kDense:
          for (int other = 0; other < block.size; ++other) {
            const Place& second = places[static_cast<std::size_t>(other)];
            if (second.kind == Place::Kind::kDense && second.part == place.part) {
              value(row, other) = parts.dense[static_cast<std::size_t>(place.part)](place.row, second.row);
            }
          }
          break;
        case Place::Kind::kDiagonal:
          value(row, column) = parts.diagonal[place.row];
          break;
        case Place::Kind::kFree:
          value(row, column) = parts.free[place.row];
          break;
        case Place::Kind::kFreePositive:
          value(row, column) = std::max(parts.free[place.row], 0.0);
          break;
        case Place::Kind::kFreeNegated:
          value(row, column) = std::max(-parts.free[place.row], 0.0);
          break;
        case Place::Kind::kAbsent:
          break;
      }
    }
    blocks.push_back(std::move(value));
  }
  return blocks;
}

TRAMMEL_INLINE double schur_density(const Model& model) {
  const auto m = static_cast<std::size_t>(model.cost.size());
  if (m == 0) {
    return 1.0;
  }
  std::vector<bool> met(m * m, false);
  std::vector<std::size_t> together;
  const auto meet = [&] {
    std::sort(together.begin(), together.end());
    together.erase(std::unique(together.begin(), together.end()), together.end());
    for (const std::size_t i : together) {
      for (const std::size_t j : together) {
        met[i * m + j] = true;
      }
    }
    together.clear();
  };
  const auto add = [&](int variable) {
    if (variable != kConstant) {
      together.push_back(static_cast<std::size_t>(variable));
    }
  };
  for (const DenseData& data : model.dense) {
    for (const Entry& entry : data.entries) {
      add(entry.variable);
    }
    for (const LowRankTerm& term : data.low_rank) {
      add(term.variable);
    }
    meet();
  }
  for (std::size_t k = 0; k < model.diagonal.entries.size(); ++k) {
    if (k > 0 && model.diagonal.entries[k].row != model.diagonal.entries[k - 1].row) {
      meet();
    }
    add(model.diagonal.entries[k].variable);
  }
  meet();
  return static_cast<double>(std::count(met.begin(), met.end(), true)) / static_cast<double>(m * m);
}

}  // namespace trammel::inline TRAMMEL_ABI::sdp::detail
