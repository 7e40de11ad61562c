// SPDX-License-Identifier: Apache-2.0
/// @file
/// Eigenvalues and eigenvectors of large symmetric tridiagonal matrices by divide and conquer.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

/// T = Z diag(w) Z' of a symmetric tridiagonal matrix, w ascending.
///
/// Method: T = diag(T1, T2) + rho u u'; with the eigenvectors of the halves it becomes D + rho z z', whose
/// eigenvalues are the roots of 1 + rho sum z_j^2 / (d_j - w) = 0 (Cuppen 1981). Components of z that are
/// negligible, and pairs of d that nearly agree, keep their eigenvectors (deflation). The vectors belong
/// to the z for which the computed roots are exact, so they are orthogonal to rounding (Gu and Eisenstat
/// 1995). Cost: at most 4/3 n^3 operations, nearly all in products; less where much is deflated. Where
/// nothing is, memory for four n x n matrices. The result is the same to the last bit for any number of
/// threads.
class TridiagonalEigen {
 public:
  explicit TridiagonalEigen(Eigen::Index size);

  /// Of the matrix with this diagonal (n) and off-diagonal (n - 1).
  void compute(const Eigen::VectorXd& diagonal, const Eigen::VectorXd& off_diagonal, unsigned threads = 1);

  [[nodiscard]] const Eigen::VectorXd& eigenvalues() const { return values_; }    ///< rising
  [[nodiscard]] const Eigen::MatrixXd& eigenvectors() const { return vectors_; }  ///< columns, orthonormal
  [[nodiscard]] Eigen::MatrixXd& eigenvectors() { return vectors_; }              ///< to be changed in place

 private:
  /// Which rows of a column of the two halves' eigenvectors are not zero.
  enum class Kind { kUpper, kBoth, kLower };
  struct Pole {
    double value = 0.0;       // d_j
    double weight = 0.0;      // z_j
    Eigen::Index column = 0;  // of the eigenvectors of the halves
    Kind kind = Kind::kUpper;
  };

  void solve(Eigen::Index first, Eigen::Index size);
  void merge(Eigen::Index first, Eigen::Index half, Eigen::Index size, double coupling);
  void deflate(Eigen::Index first, Eigen::Index half, Eigen::Index size, double coupling);
  void find_roots(double rho);
  [[nodiscard]] double find_root(Eigen::Index index, double rho, Eigen::Ref<Eigen::VectorXd> distance) const;
  void exact_weights();
  void make_vectors();
  void store(Eigen::Index first, Eigen::Index half, Eigen::Index size);

  Eigen::VectorXd values_, off_diagonal_;
  Eigen::MatrixXd vectors_;
  Eigen::MatrixXd inner_;   // first d_j - w_i in column i, then the eigenvectors of D + rho z z'
  Eigen::MatrixXd gather_;  // columns of the halves' eigenvectors, by kind
  Eigen::MatrixXd product_;
  std::vector<Pole> poles_;                                // kept, with rising values
  std::vector<Pole> deflated_;                             // eigenvalues already
  std::vector<Eigen::Index> by_kind_;                      // the kept ones: upper, both, lower
  Eigen::VectorXd pole_values_, squares_, roots_, exact_;  // of the kept ones; squares_: z_j^2
  unsigned threads_ = 1;
};

}  // namespace trammel::inline TRAMMEL_ABI::linalg

#ifndef TRAMMEL_COMPILED
#include "trammel/linalg/tridiagonal_eigen_impl.hpp"
#endif
