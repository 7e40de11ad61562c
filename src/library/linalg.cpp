// SPDX-License-Identifier: Apache-2.0
#include "trammel/linalg/cholesky.hpp"
#include "trammel/linalg/eigenvalues.hpp"
#include "trammel/linalg/gram_eigen_impl.hpp"
#include "trammel/linalg/lu.hpp"
#include "trammel/linalg/qr.hpp"
#include "trammel/linalg/stacked_triangle_impl.hpp"
#include "trammel/linalg/svd.hpp"
#include "trammel/linalg/symmetric_eigen.hpp"
#include "trammel/linalg/tridiagonal_eigen_impl.hpp"
#include "trammel/linalg/tridiagonal_form_impl.hpp"

template class Eigen::LLT<Eigen::MatrixXd>;
template class Eigen::LDLT<Eigen::MatrixXd>;
template class Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>;
template class Eigen::HouseholderQR<Eigen::MatrixXd>;
template class Eigen::ColPivHouseholderQR<Eigen::MatrixXd>;
template class Eigen::PartialPivLU<Eigen::MatrixXd>;
template class Eigen::PartialPivLU<Eigen::MatrixXcd>;
template class Eigen::EigenSolver<Eigen::MatrixXd>;
template class Eigen::JacobiSVD<Eigen::MatrixXd>;
