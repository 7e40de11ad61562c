// SPDX-License-Identifier: Apache-2.0
/// @file
/// Orthogonal reduction of very many short rows to a banded triangle.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/error.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

/// Triangle R and right-hand side d with R'R = A'A, R'd = A'b, and |A x - b|^2 = |R x - d|^2 + residual.
struct ReducedRows {
  Eigen::MatrixXd factor;  ///< R without its zero rows, at most p x p
  Eigen::VectorXd rhs;     ///< d
  double residual = 0.0;
};

/// Least-squares rows A x = b where each row of A has `Width` consecutive entries that start at column
/// `Step` * block, and entries in the last `border` columns: collected one by one, in any order, without ever
/// forming A'A.
///
/// Method: one small triangle per block, into which a row is rotated (Givens; Gentleman 1973, "Least squares
/// computations by Givens transformations without square roots", row by row); the triangles are then merged
/// from left to right, each leaving its first `Step` rows behind. What is left of a row when its band is
/// annihilated goes to a triangle of the border.
/// Cost: O((Width + border)^2) per row, O(Width (Width + border)) memory per block, whatever the number of
/// rows.
template <int Width, int Step>
class BandedRows {
  static_assert(Step >= 1 && Step <= Width);

 public:
  /// p = Step (blocks - 1) + Width + border columns.
  explicit BandedRows(Eigen::Index blocks, Eigen::Index border = 0)
      : row_(Width + border + 1), corner_(Rows::Zero(border, border + 1)) {
    require(blocks >= 1, "blocks", std::to_string(blocks), "at least 1");
    require(border >= 0, "border", std::to_string(border), "at least 0");
    triangles_.assign(static_cast<std::size_t>(blocks), Rows::Zero(Width, row_.size()));
  }

  [[nodiscard]] Eigen::Index columns() const noexcept { return band_columns() + corner_.rows(); }

  /// Adds the row of entries `row` in the columns Step * block ... with right-hand side `rhs`.
  template <class Derived>
  void add(Eigen::Index block, const Eigen::MatrixBase<Derived>& row, double rhs) {
    add(block, row, Eigen::RowVectorXd::Zero(corner_.rows()), rhs);
  }

  /// The same with the entries `border` in the last columns.
  template <class Derived>
  void add(Eigen::Index block, const Eigen::MatrixBase<Derived>& row, const Eigen::RowVectorXd& border,
           double rhs) {
    row_.template head<Width>() = row;
    row_.segment(Width, border.size()) = border;
    row_(row_.size() - 1) = rhs;
    residual_ += rotated_out(triangles_[static_cast<std::size_t>(block)], corner_, row_);
  }

  /// The factor of everything added so far.
  [[nodiscard]] ReducedRows reduce() const {
    const Eigen::Index border = corner_.rows();
    Eigen::MatrixXd factor = Eigen::MatrixXd::Zero(columns(), columns());
    Eigen::VectorXd rhs = Eigen::VectorXd::Zero(columns());
    Eigen::Index used = 0;
    const double residual = merge([&](Eigen::Index first, const auto& band, const auto& rest) {
      if (!band.isZero(0.0)) {
        factor.row(used).segment(first, band.size()) = band;
        factor.row(used).tail(rest.size() - 1) = rest.head(rest.size() - 1);
        rhs(used++) = rest(border);
      }
    });
    factor.conservativeResize(used, Eigen::NoChange);
    rhs.conservativeResize(used);
    return {std::move(factor), std::move(rhs), residual};
  }

  /// Calls `keep(first, band, rest)` for each row of the triangle from the first to the last, zero rows
  /// included: entries `band` in the columns first.., then (for rows of the band) those of the border and the
  /// right-hand side in `rest`. Rows of the border have their entries in `band` and `rest`. Returns the
  /// residual.
  template <class Keep>
  [[nodiscard]] double merge(Keep&& keep) const {
    const Eigen::Index border = corner_.rows();
    const Eigen::Index behind = border + 1;  // columns after the band: border and right-hand side
    double residual = residual_;
    Rows corner = corner_;
    Rows carried = Rows::Zero(Width, row_.size());  // rows of the blocks before, in the columns of this block
    const auto blocks = static_cast<Eigen::Index>(triangles_.size());
    for (Eigen::Index b = 0; b < blocks; ++b) {
      Rows triangle = triangles_[static_cast<std::size_t>(b)];
      for (int k = 0; k < Width; ++k) {
        Row row = carried.row(k);
        residual += rotated_out(triangle, corner, row);
      }
      const int done = b + 1 < blocks ? Step : Width;
      for (int k = 0; k < done; ++k) {
        keep(Step * b, triangle.row(k).template head<Width>(), triangle.row(k).tail(behind));
      }
      carried.setZero();
      for (int k = Step; k < Width; ++k) {
        carried.row(k - Step).template head<Width - Step>() =
            triangle.row(k).template segment<Width - Step>(Step);
        carried.row(k - Step).tail(behind) = triangle.row(k).tail(behind);
      }
    }
    for (Eigen::Index k = 0; k < border; ++k) {
      keep(band_columns(), corner.row(k).head(border), corner.row(k));
    }
    return residual;
  }

  /// The rows of `count` blocks from `first` on, in columns counted from the first of these. The residual of
  /// single rows stays behind.
  [[nodiscard]] BandedRows part(Eigen::Index first, Eigen::Index count) const {
    require(first >= 0 && count >= 1 && first + count <= static_cast<Eigen::Index>(triangles_.size()),
            "blocks", std::to_string(first) + " to " + std::to_string(first + count),
            "some of the " + std::to_string(triangles_.size()) + " there are");
    BandedRows result(count, corner_.rows());
    std::copy_n(triangles_.begin() + first, count, result.triangles_.begin());
    return result;
  }

 private:
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  using Row = Eigen::Matrix<double, 1, Eigen::Dynamic>;

  [[nodiscard]] Eigen::Index band_columns() const noexcept {
    return Step * (static_cast<Eigen::Index>(triangles_.size()) - 1) + Width;
  }

  /// Rotates the entries `first`.. of `row` into an upper triangle whose columns are those from `first` on.
  static void rotate_in(Rows& triangle, Row& row, Eigen::Index first) {
    const Eigen::Index columns = triangle.cols();
    for (Eigen::Index k = 0; k < triangle.rows(); ++k) {
      const double below = row(first + k);
      if (below == 0.0) {
        continue;
      }
      const double radius = std::hypot(triangle(k, k), below);
      const double c = triangle(k, k) / radius;
      const double s = below / radius;
      triangle(k, k) = radius;
      row(first + k) = 0.0;
      for (Eigen::Index j = k + 1; j < columns; ++j) {
        const double upper = triangle(k, j);
        triangle(k, j) = c * upper + s * row(first + j);
        row(first + j) = c * row(first + j) - s * upper;
      }
    }
  }

  /// Rotates `row` into `triangle` and its border into `corner`; returns the square of what is left of its
  /// right-hand side.
  static double rotated_out(Rows& triangle, Rows& corner, Row& row) {
    rotate_in(triangle, row, 0);
    rotate_in(corner, row, Width);
    const double left = row(row.size() - 1);
    return left * left;
  }

  std::vector<Rows> triangles_;
  Row row_;      ///< scratch
  Rows corner_;  ///< triangle of the border with right-hand side
  double residual_ = 0.0;
};

}  // namespace trammel::inline TRAMMEL_ABI::linalg
