// SPDX-License-Identifier: Apache-2.0
/// @file
/// The nonnegative orthant.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "trammel/sdp/detail/cone.hpp"
#include "trammel/sdp/detail/model.hpp"

namespace trammel::inline TRAMMEL_ABI::sdp::detail {

/// Diagonal rows: X and Y are vectors, every operation is entrywise.
template <class ScalarType>
class DiagonalCone {
 public:
  using Scalar = ScalarType;
  using Vector = VectorOf<Scalar>;
  using Matrix = MatrixOf<Scalar>;

  explicit DiagonalCone(const DiagonalData& data) : data_(data) {
    start_of_row_.assign(static_cast<std::size_t>(data.size) + 1, data.entries.size());
    for (std::size_t k = data.entries.size(); k-- > 0;) {
      start_of_row_[static_cast<std::size_t>(data.entries[k].row)] = k;
    }
    for (std::size_t r = static_cast<std::size_t>(data.size); r-- > 0;) {
      start_of_row_[r] = std::min(start_of_row_[r], start_of_row_[r + 1]);
    }
    d_ = Vector::Zero(data.size);
    dx_ = d_;
    dy_ = d_;
    second_ = d_;
  }

  [[nodiscard]] Eigen::Index size() const { return data_.size; }
  [[nodiscard]] const Vector& x() const { return x_; }
  [[nodiscard]] const Vector& y() const { return y_; }

  void set(const Vector& x, const Vector& y) {
    x_ = x;
    y_ = y;
  }

  void update_residual(const Vector& x) {
    d_ = -x_;
    add_operator(x, Scalar(1), d_);
  }

  [[nodiscard]] bool factorise() const {
    return (x_.array() > Scalar(0)).all() && (y_.array() > Scalar(0)).all();
  }

  void add_adjoint_y(Vector& out, Scalar scale) const { add_adjoint(y_, scale, out); }

  void add_schur(Matrix& schur) const {
    for (Eigen::Index r = 0; r < size(); ++r) {
      add_row_products(r, y_[r] / x_[r], schur);
    }
  }

  [[nodiscard]] Eigen::Index root_rows() const { return size(); }

  void fill_root(Eigen::Index first, Matrix& root) const {
    using std::sqrt;
    for (const DiagonalEntry& e : data_.entries) {
      if (e.variable != kConstant) {
        root(first + e.row, e.variable) = Scalar(e.value) * sqrt(y_[e.row] / x_[e.row]);
      }
    }
  }

  void add_gram(Matrix& gram) const {
    for (Eigen::Index r = 0; r < size(); ++r) {
      add_row_products(r, Scalar(1), gram);
    }
  }

  void subtract_from_y(const Vector& z) {
    dy_.setZero();
    add_operator(z, Scalar(0), dy_);
    y_ -= dy_;
  }

  [[nodiscard]] double smallest_y() const {
    double smallest = std::numeric_limits<double>::infinity();
    for (Eigen::Index r = 0; r < size(); ++r) {
      smallest = std::min(smallest, static_cast<double>(y_[r]));
    }
    return smallest;
  }

  void begin_direction(Scalar mu, bool second_order, Vector& out) {
    if (second_order) {
      second_ = dx_.cwiseProduct(dy_);
    } else {
      second_.setZero();
    }
    mu_ = mu;
    const Vector target =
        ((mu_ - second_.array() - d_.array() * y_.array()) / x_.array() - y_.array()).matrix();
    add_adjoint(target, Scalar(1), out);
  }

  void finish_direction(const Vector& dx) {
    dx_ = d_;
    add_operator(dx, Scalar(0), dx_);
    dy_ = ((mu_ - second_.array() - dx_.array() * y_.array()) / x_.array() - y_.array()).matrix();
  }

  void refine_direction(const Vector& dx) {
    Vector change = Vector::Zero(size());
    add_operator(dx, Scalar(0), change);
    dx_ += change;
    dy_.array() -= change.array() * y_.array() / x_.array();
  }

  void add_adjoint_dy(Vector& out, Scalar scale) const { add_adjoint(dy_, scale, out); }

  [[nodiscard]] double max_step(Side side, Scalar /*enough*/) const {
    const Vector& point = side == Side::kX ? x_ : y_;
    const Vector& direction = side == Side::kX ? dx_ : dy_;
    double step = std::numeric_limits<double>::infinity();
    for (Eigen::Index r = 0; r < size(); ++r) {
      if (direction[r] < Scalar(0)) {
        step = std::min(step, static_cast<double>(-point[r] / direction[r]));
      }
    }
    return step;
  }

  void step(Side side, Scalar length) {
    if (side == Side::kX) {
      x_ += length * dx_;
    } else {
      y_ += length * dy_;
    }
  }

  [[nodiscard]] Scalar inner_product() const { return x_.dot(y_); }
  [[nodiscard]] Scalar after_step(Scalar a, Scalar b) const { return (x_ + a * dx_).dot(y_ + b * dy_); }
  [[nodiscard]] Scalar residual_norm_squared() const { return d_.squaredNorm(); }

  /// ||sum x_i F_i - X||^2 = ||D + F_0||^2.
  [[nodiscard]] Scalar distance_to_ray_squared() const {
    Vector difference = d_;
    add_operator(Vector::Zero(0), Scalar(-1), difference);
    return difference.squaredNorm();
  }

  [[nodiscard]] Scalar constant_times_y() const {
    Scalar sum(0);
    for (const DiagonalEntry& e : data_.entries) {
      if (e.variable == kConstant) {
        sum += Scalar(e.value) * y_[e.row];
      }
    }
    return sum;
  }

 private:
  /// Entries of variables (not of the constant) in a row.
  [[nodiscard]] std::pair<std::size_t, std::size_t> row(Eigen::Index r) const {
    std::size_t begin = start_of_row_[static_cast<std::size_t>(r)];
    const std::size_t end = start_of_row_[static_cast<std::size_t>(r) + 1];
    if (begin < end && data_.entries[begin].variable == kConstant) {
      ++begin;
    }
    return {begin, end};
  }

  void add_row_products(Eigen::Index r, Scalar weight, Matrix& out) const {
    const auto [begin, end] = row(r);
    for (std::size_t i = begin; i < end; ++i) {
      const Scalar scaled = weight * Scalar(data_.entries[i].value);
      for (std::size_t j = i; j < end; ++j) {
        out(data_.entries[j].variable, data_.entries[i].variable) += scaled * Scalar(data_.entries[j].value);
      }
    }
  }

  void add_adjoint(const Vector& y, Scalar scale, Vector& out) const {
    for (const DiagonalEntry& e : data_.entries) {
      if (e.variable != kConstant) {
        out[e.variable] += scale * Scalar(e.value) * y[e.row];
      }
    }
  }

  /// out += sum x_i F_i - constant F_0; an empty x counts as zero.
  void add_operator(const Vector& x, Scalar constant, Vector& out) const {
    for (const DiagonalEntry& e : data_.entries) {
      if (e.variable == kConstant) {
        out[e.row] -= Scalar(e.value) * constant;
      } else if (x.size() > 0) {
        out[e.row] += Scalar(e.value) * x[e.variable];
      }
    }
  }

  const DiagonalData& data_;
  std::vector<std::size_t> start_of_row_;
  Vector x_;
  Vector y_;
  Vector d_;
  Vector dx_;
  Vector dy_;
  Vector second_;
  Scalar mu_{0};
};

}  // namespace trammel::inline TRAMMEL_ABI::sdp::detail
