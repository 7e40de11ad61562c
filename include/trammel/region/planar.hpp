// SPDX-License-Identifier: Apache-2.0
/// @file
/// Regions of two parameters as exact polygons, and their images among the plants.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/region/level_walk.hpp"
#include "trammel/region/lscr.hpp"
#include "trammel/region/plant.hpp"

namespace trammel::inline TRAMMEL_ABI::region {

/// A union of polygons in the plane of two parameters.
struct PlanarRegion {
  std::vector<Eigen::Vector2d> vertices;  ///< of all components, each counter-clockwise or clockwise
  std::vector<int> first_vertex;          ///< first vertex of each component, and vertices.size() at the end
  bool exact = false;                     ///< the polygon is the region; false: it contains the region
  bool bounded = true;                    ///< false: some component goes on for ever
  double area = 0.0;                      ///< infinite if not bounded
  Eigen::Vector2d lower = Eigen::Vector2d::Zero();  ///< smallest values of the parameters, may be infinite
  Eigen::Vector2d upper = Eigen::Vector2d::Zero();  ///< largest values

  [[nodiscard]] int components() const {
    return first_vertex.empty() ? 0 : static_cast<int>(first_vertex.size()) - 1;
  }
};

/// Work space of exact_polygon, kept between calls.
struct PlanarWork {
  struct Channel {
    std::vector<Line> lines;
    LevelChain lower;
    LevelChain upper;
    IntervalList strip;
    bool is_strip = false;
  };
  std::vector<Channel> channels;
  LevelWalkWork walk;
  CountSweep sweep;
  std::vector<double> events;
  std::vector<Line> active;
  std::vector<Eigen::Vector2d> lower_points;
  std::vector<Eigen::Vector2d> upper_points;
};

/// The region of two parameters as polygons, exactly: in coordinates x along one direction and t along
/// another one in which every channel's sums all rise or all fall, a channel's set is the strip between the
/// q-th smallest and the q-th largest of M - 1 lines t_j(x).
/// Returns false, and leaves `out` empty, where no such direction exists for all channels together (few or
/// badly placed probes); `outer_polygon` of support.hpp works there too. Error if d is not 2.
/// Does not allocate once work and out have grown.
[[nodiscard]] bool exact_polygon(const LscrRegion& region, PlanarWork& work, PlanarRegion& out);

/// Image of a region of two impulse parameters among the plants.
struct PlantImage {
  PlanarRegion outline;  ///< vertices mapped; edges between them are arcs of hyperbolas
  double area = 0.0;     ///< exact to rounding; infinite where the map has a pole inside
};

/// Maps a region of (theta_1, theta_2) by plant_from_impulse. The area is the integral along the boundary of
/// the mapped region. Error unless the model has two unknown coefficients.
[[nodiscard]] PlantImage plant_image(const PlanarRegion& region, const PlantModel& model);

}  // namespace trammel::inline TRAMMEL_ABI::region

#ifndef TRAMMEL_COMPILED
#include "trammel/region/planar_impl.hpp"
#endif
