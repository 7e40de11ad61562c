// SPDX-License-Identifier: Apache-2.0
/// @file
/// Orthogonal reduction of very many short rows to a banded triangle.
#pragma once

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
/// `Step` * block: collected one by one, in any order, without ever forming A'A.
///
/// Method: one small triangle per block, into which a row is rotated (Givens; Gentleman 1973, "Least squares
/// computations by Givens transformations without square roots", row by row); the triangles are then merged
/// from left to right, each leaving its first `Step` rows behind.
/// Cost: O(Width^2) per row and O(Width^2) memory per block, whatever the number of rows.
template <int Width, int Step>
class BandedRows {
  static_assert(Step >= 1 && Step <= Width);

 public:
  /// p = Step (blocks - 1) + Width columns.
  explicit BandedRows(Eigen::Index blocks) : triangles_(static_cast<std::size_t>(blocks), Triangle::Zero()) {
    require(blocks >= 1, "blocks", std::to_string(blocks), "at least 1");
  }

  [[nodiscard]] Eigen::Index columns() const noexcept {
    return Step * (static_cast<Eigen::Index>(triangles_.size()) - 1) + Width;
  }

  /// Adds the row of entries `row` in the columns Step * block ... with right-hand side `rhs`.
  template <class Derived>
  void add(Eigen::Index block, const Eigen::MatrixBase<Derived>& row, double rhs) {
    Row extended;
    extended.template head<Width>() = row;
    extended(Width) = rhs;
    rotate_in(triangles_[static_cast<std::size_t>(block)], extended);
  }

  /// The factor of everything added so far.
  [[nodiscard]] ReducedRows reduce() const {
    Eigen::MatrixXd factor = Eigen::MatrixXd::Zero(columns(), columns());
    Eigen::VectorXd rhs = Eigen::VectorXd::Zero(columns());
    double residual = residual_;
    Eigen::Index used = 0;
    Triangle carried = Triangle::Zero();  // rows of the blocks before, in the columns of this block
    const auto blocks = static_cast<Eigen::Index>(triangles_.size());
    for (Eigen::Index b = 0; b < blocks; ++b) {
      Triangle triangle = triangles_[static_cast<std::size_t>(b)];
      for (int k = 0; k < Width; ++k) {
        Row row = carried.row(k);
        residual += rotated_out(triangle, row);
      }
      const int done = b + 1 < blocks ? Step : Width;
      for (int k = 0; k < done; ++k) {
        if (!triangle.row(k).template head<Width>().isZero(0.0)) {
          factor.row(used).segment(Step * b, Width) = triangle.row(k).template head<Width>();
          rhs(used++) = triangle(k, Width);
        }
      }
      carried.setZero();
      for (int k = Step; k < Width; ++k) {
        carried.row(k - Step).template head<Width - Step>() =
            triangle.row(k).template segment<Width - Step>(Step);
        carried(k - Step, Width) = triangle(k, Width);
      }
    }
    factor.conservativeResize(used, Eigen::NoChange);
    rhs.conservativeResize(used);
    return {std::move(factor), std::move(rhs), residual};
  }

 private:
  using Triangle = Eigen::Matrix<double, Width, Width + 1, Eigen::RowMajor>;
  using Row = Eigen::Matrix<double, 1, Width + 1>;

  void rotate_in(Triangle& triangle, Row& row) { residual_ += rotated_out(triangle, row); }

  /// Rotates `row` into `triangle`; returns the square of what is left of its right-hand side.
  static double rotated_out(Triangle& triangle, Row& row) {
    for (int k = 0; k < Width; ++k) {
      if (row(k) == 0.0) {
        continue;
      }
      const double radius = std::hypot(triangle(k, k), row(k));
      const double c = triangle(k, k) / radius;
      const double s = row(k) / radius;
      triangle(k, k) = radius;
      row(k) = 0.0;
      for (int j = k + 1; j <= Width; ++j) {
        const double upper = triangle(k, j);
        triangle(k, j) = c * upper + s * row(j);
        row(j) = c * row(j) - s * upper;
      }
    }
    return row(Width) * row(Width);
  }

  std::vector<Triangle, Eigen::aligned_allocator<Triangle>> triangles_;
  double residual_ = 0.0;
};

}  // namespace trammel::inline TRAMMEL_ABI::linalg
