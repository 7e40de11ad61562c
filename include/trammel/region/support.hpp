// SPDX-License-Identifier: Apache-2.0
/// @file
/// Outer summaries of any confidence region: bounds of linear functions by branch and bound, boxes, and
/// convex polygons.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/error.hpp"
#include "trammel/core/settings.hpp"
#include "trammel/linalg/svd.hpp"
#include "trammel/region/estimate.hpp"
#include "trammel/region/guarantee.hpp"
#include "trammel/region/planar.hpp"

namespace trammel::inline TRAMMEL_ABI::region {

/// Coordinates in which a region is searched: p = origin + basis z, |z_k| <= reach.
struct SearchFrame {
  Eigen::VectorXd origin;
  Eigen::MatrixXd basis;  ///< d x d, regular
  double reach = 0.0;     ///< a region that touches |z_k| = reach is taken for unbounded
  double unit = 1.0;      ///< in z, of the order of the region's size
};

/// Settings of the search.
struct SupportSettings {
  double relative_tolerance = 1e-3;  ///< of the distance from the origin, at which a bound is good enough
  int max_boxes = 20000;             ///< after which the bound reached so far is returned; it is valid too
};

template <class Settings, class Visitor>
requires std::same_as<std::remove_const_t<Settings>, SupportSettings>
void visit_fields(Settings& settings, Visitor&& visit) {
  visit(
      FieldDoc{.name = "relative_tolerance",
               .unit = "",
               .meaning = "a bound is good enough when a point of the region is this close, relative to its "
                          "distance from the centre of the search",
               .minimum = 1e-12,
               .maximum = 1.0},
      settings.relative_tolerance);
  visit(FieldDoc{.name = "max_boxes",
                 .unit = "",
                 .meaning = "boxes examined per bound; what is reached by then is valid but may be wide",
                 .minimum = 1.0,
                 .maximum = 1e9},
        settings.max_boxes);
}

/// A bound of direction . p over a region.
struct SupportBound {
  double value = 0.0;  ///< no point of the region is beyond it (infinite: not bounded, -infinite: empty)
  bool tight = false;  ///< within the tolerance of a point of the region
};

/// A frame from the instrumental estimate: z = M_0 (p - p^) has the scale of the sums, whose spread is about
/// `spread`. Works with more channels than parameters too. Where the estimate does not exist: the unit frame.
[[nodiscard]] inline SearchFrame search_frame(const InstrumentalEstimate& estimate, double spread) {
  constexpr double kReach = 1e6;  // spreads; a region farther away than that has no useful bound
  const Eigen::Index d = estimate.parameters.size();
  SearchFrame frame;
  frame.unit = spread > 0.0 ? spread : 1.0;
  frame.reach = kReach * frame.unit;
  if (!std::isfinite(estimate.condition)) {
    frame.origin = Eigen::VectorXd::Zero(d);
    frame.basis = Eigen::MatrixXd::Identity(d, d);
    return frame;
  }
  const linalg::Svd svd(estimate.matrix, Eigen::ComputeThinU | Eigen::ComputeThinV);
  frame.origin = estimate.parameters;
  frame.basis = svd.matrixV() * svd.singularValues().cwiseInverse().asDiagonal();
  if (estimate.matrix.rows() == d) {
    frame.basis = frame.basis * svd.matrixU().transpose();  // M_0^-1: one coordinate per channel
  }
  return frame;
}

namespace detail {

/// A box of z with the largest value of the direction over it.
struct SearchBox {
  Eigen::VectorXd centre;
  Eigen::VectorXd half;
  double bound = 0.0;
};

}  // namespace detail

/// Upper bound of direction . p over the region by best-first branch and bound: boxes of z are dropped when
/// `region.excludes` proves that they hold no point of it, and halved along their longest side otherwise.
template <ConfidenceRegion Region>
[[nodiscard]] SupportBound support(const Region& region, const SearchFrame& frame,
                                   const Eigen::VectorXd& direction, const SupportSettings& settings = {}) {
  trammel::validate(settings, "support: settings");
  const Eigen::Index d = region.dimension();
  require(direction.size() == d && frame.origin.size() == d, [&] {
    return ErrorDetail{
        "support: direction or frame",
        std::to_string(direction.size()) + " and " + std::to_string(frame.origin.size()) + " numbers",
        std::to_string(d) + " each"};
  });
  const Eigen::VectorXd weights = frame.basis.transpose() * direction;
  const double offset = direction.dot(frame.origin);
  const auto bound_of = [&](const detail::SearchBox& box) {
    return offset + weights.dot(box.centre) + weights.cwiseAbs().dot(box.half);
  };
  const auto lower = [](const detail::SearchBox& a, const detail::SearchBox& b) { return a.bound < b.bound; };
  std::vector<detail::SearchBox> heap;
  heap.push_back({Eigen::VectorXd::Zero(d), Eigen::VectorXd::Constant(d, frame.reach), 0.0});
  heap.front().bound = bound_of(heap.front());
  double reached = -detail::kInfinity;  // largest value at a point of the region seen so far
  int examined = 0;
  constexpr double kSmallest = 1e-9;  // boxes this small, in units of the frame, are not halved any more
  while (!heap.empty()) {
    std::pop_heap(heap.begin(), heap.end(), lower);
    const detail::SearchBox box = std::move(heap.back());
    heap.pop_back();
    const Eigen::VectorXd centre = frame.origin + frame.basis * box.centre;
    if (region.contains(centre)) {
      reached = std::max(reached, direction.dot(centre));
    }
    const double gap = settings.relative_tolerance * std::abs(box.bound - offset);
    const bool tight = box.bound - reached <= gap;
    Eigen::Index longest = 0;
    const double half = box.half.maxCoeff(&longest);
    if (tight || half <= kSmallest * frame.unit || ++examined > settings.max_boxes) {
      const bool touches = ((box.centre.cwiseAbs() + box.half).array() >= frame.reach).any();
      return {touches ? detail::kInfinity : box.bound, tight && !touches};
    }
    for (const double side : {-1.0, 1.0}) {
      detail::SearchBox part = box;
      part.half(longest) = half / 2.0;
      part.centre(longest) += side * half / 2.0;
      part.bound = bound_of(part);
      const Eigen::MatrixXd generators = frame.basis * part.half.asDiagonal();
      if (!region.excludes(frame.origin + frame.basis * part.centre, generators)) {
        heap.push_back(std::move(part));
        std::push_heap(heap.begin(), heap.end(), lower);
      }
    }
  }
  return {-detail::kInfinity, true};
}

/// Smallest and largest values of every parameter, as outer bounds.
struct OuterBox {
  Eigen::VectorXd lower;
  Eigen::VectorXd upper;
  bool tight = true;  ///< every bound is within its tolerance
};

template <ConfidenceRegion Region>
[[nodiscard]] OuterBox outer_box(const Region& region, const SearchFrame& frame,
                                 const SupportSettings& settings = {}) {
  const Eigen::Index d = region.dimension();
  OuterBox box{Eigen::VectorXd(d), Eigen::VectorXd(d), true};
  for (Eigen::Index k = 0; k < d; ++k) {
    const SupportBound upper = support(region, frame, Eigen::VectorXd::Unit(d, k), settings);
    const SupportBound lower = support(region, frame, -Eigen::VectorXd::Unit(d, k), settings);
    box.upper(k) = upper.value;
    box.lower(k) = -lower.value;
    box.tight = box.tight && upper.tight && lower.tight;
  }
  return box;
}

/// A convex polygon that contains a region of two parameters: the intersection of half planes in `sides`
/// directions, evenly spread in the coordinates of the frame. Without vertices where the region is empty or
/// some direction is not bounded (`bounded` tells which).
template <ConfidenceRegion Region>
[[nodiscard]] PlanarRegion outer_polygon(const Region& region, const SearchFrame& frame, int sides = 32,
                                         const SupportSettings& settings = {}) {
  require(region.dimension() == 2, [&] {
    return ErrorDetail{"outer_polygon: region", std::to_string(region.dimension()) + " parameters", "2"};
  });
  require(sides >= 3, [&] {
    return ErrorDetail{"outer_polygon: sides", std::to_string(sides), "at least 3"};
  });
  PlanarRegion out;
  out.lower.setConstant(detail::kInfinity);
  out.upper.setConstant(-detail::kInfinity);
  const Eigen::Matrix2d basis = frame.basis;
  const Eigen::Vector2d origin = frame.origin;
  const double size = 4.0 * frame.reach;
  std::vector<Eigen::Vector2d> polygon{{-size, -size}, {size, -size}, {size, size}, {-size, size}};
  std::vector<Eigen::Vector2d> clipped;
  for (int k = 0; k < sides; ++k) {
    const double angle = 2.0 * std::numbers::pi * k / sides;
    const Eigen::Vector2d normal(std::cos(angle), std::sin(angle));  // in z
    // direction . p with basis' direction = normal
    Eigen::VectorXd direction(2);
    direction << basis(1, 1) * normal(0) - basis(1, 0) * normal(1),
        basis(0, 0) * normal(1) - basis(0, 1) * normal(0);
    direction /= basis.determinant();
    const SupportBound bound = support(region, frame, direction, settings);
    if (bound.value == -detail::kInfinity) {
      out.first_vertex.push_back(0);
      return out;
    }
    if (std::isinf(bound.value)) {
      out.bounded = false;
      out.area = detail::kInfinity;
      out.lower.setConstant(-detail::kInfinity);
      out.upper.setConstant(detail::kInfinity);
      return out;
    }
    const double limit = bound.value - direction.dot(frame.origin);
    clipped.clear();
    for (std::size_t v = 0; v < polygon.size(); ++v) {
      const Eigen::Vector2d& here = polygon[v];
      const Eigen::Vector2d& next = polygon[(v + 1) % polygon.size()];
      const double here_beyond = normal.dot(here) - limit;
      const double next_beyond = normal.dot(next) - limit;
      if (here_beyond <= 0.0) {
        clipped.push_back(here);
      }
      if ((here_beyond < 0.0 && next_beyond > 0.0) || (here_beyond > 0.0 && next_beyond < 0.0)) {
        clipped.push_back(here + (next - here) * (here_beyond / (here_beyond - next_beyond)));
      }
    }
    polygon.swap(clipped);
  }
  out.first_vertex.push_back(0);
  for (std::size_t v = 0; v < polygon.size(); ++v) {
    const Eigen::Vector2d point = origin + basis * polygon[v];
    const Eigen::Vector2d next = origin + basis * polygon[(v + 1) % polygon.size()];
    out.vertices.push_back(point);
    out.lower = out.lower.cwiseMin(point);
    out.upper = out.upper.cwiseMax(point);
    out.area += (point(0) * next(1) - point(1) * next(0)) / 2.0;
  }
  out.area = std::abs(out.area);
  out.first_vertex.push_back(static_cast<int>(out.vertices.size()));
  return out;
}

}  // namespace trammel::inline TRAMMEL_ABI::region
