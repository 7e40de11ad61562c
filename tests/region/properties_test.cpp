// SPDX-License-Identifier: Apache-2.0
// Laws that every region obeys, on random loops of random orders.
#include <gtest/gtest.h>

#include "trammel/core/random.hpp"
#include "trammel/region/loop_experiment.hpp"
#include "trammel/region/lscr.hpp"
#include "trammel/region/planar.hpp"
#include "trammel/region/self_normalised.hpp"
#include "trammel/region/sps.hpp"
#include "trammel/region/support.hpp"

namespace {

using namespace trammel::region;
using trammel::RandomStream;

static_assert(ConfidenceRegion<LscrRegion>);
static_assert(ConfidenceRegion<SpsRegion>);
static_assert(ConfidenceRegion<EllipsoidRegion>);
static_assert(ConfidenceRegion<SelfNormalisedRegion>);

constexpr std::uint64_t kSeed = 20131;

/// A stable random plant with `unknowns` unknown coefficients, always b_l among them.
LoopExperiment random_experiment(RandomStream& random, int unknowns) {
  LoopExperiment experiment;
  const auto na = static_cast<Eigen::Index>(random.uniform() * 3.0);
  const auto terms = static_cast<Eigen::Index>(std::max<double>(1.0, static_cast<double>(unknowns - na)) +
                                               std::floor(2.0 * random.uniform()));
  experiment.plant.delay = 1 + static_cast<int>(random.uniform() * 3.0);
  experiment.plant.a.resize(na);
  experiment.plant.b.resize(terms);
  experiment.model = {};
  experiment.model.delay = experiment.plant.delay;
  int left = unknowns - 1;
  for (double& a : experiment.plant.a) {
    a = (2.0 * random.uniform() - 1.0) / static_cast<double>(na + 1);
    experiment.model.a.push_back(left > 0 ? std::nullopt : std::optional<double>(a));
    left -= left > 0 ? 1 : 0;
  }
  for (Eigen::Index k = 0; k < terms; ++k) {
    experiment.plant.b(k) = k == 0 ? 1.0 : 2.0 * random.uniform() - 1.0;
    experiment.model.b.push_back(k == 0 || left > 0 ? std::nullopt
                                                    : std::optional<double>(experiment.plant.b(k)));
    left -= k > 0 && left > 0 ? 1 : 0;
  }
  experiment.feedback = LoopFeedback::kNone;
  experiment.noise = random.sign() > 0.0 ? LoopNoise::kGaussianBias : LoopNoise::kDeterministic;
  experiment.probe = random.sign() > 0.0 ? ProbeLaw::kSigns : ProbeLaw::kUniform;
  experiment.period = unknowns;
  experiment.probes = 40 + static_cast<int>(random.uniform() * 100.0);
  experiment.gain = 3.0;
  return experiment;
}

/// All four regions of one loop.
struct Regions {
  Regions(const LoopExperiment& experiment, std::uint64_t run) {
    LoopSimulator simulator(experiment);
    ProbedRecord record;
    simulator.simulate(kSeed, run, record);
    plant_residuals(experiment.model, record, 0, {}, residuals);
    RandomStream random(kSeed, 1000000 + run);
    BinaryStrings strings;
    std::vector<char> ties;
    strings.resize(59, experiment.probes);
    draw_distinct_strings(random, strings);
    draw_tie_flags(random, 60, ties);
    lscr.assign(residuals, strings, ties, 3, ResidualForm::kPlant);
    draw_strings(random, strings);
    sps.assign(residuals, strings, ties, 6);
    self_normalised.assign(residuals, 0.05, 1.0 * experiment.probes);
    if (residuals.channels == residuals.dimension) {
      ellipsoid = outer_ellipsoid(sps);
    }
    estimate = lscr.estimate();
    frame = search_frame(estimate, std::sqrt(experiment.probes) * 3.0);
  }
  template <class Visitor>
  void visit(Visitor&& visitor) const {
    visitor(lscr, "lscr");
    visitor(sps, "sps");
    visitor(self_normalised, "self_normalised");
    visitor(ellipsoid, "ellipsoid");
  }
  ProbedResiduals residuals;
  LscrRegion lscr;
  SpsRegion sps;
  SelfNormalisedRegion self_normalised;
  EllipsoidRegion ellipsoid;
  InstrumentalEstimate estimate;
  SearchFrame frame;
};

/// A point near the region, or far away now and then.
Eigen::VectorXd random_point(RandomStream& random, const SearchFrame& frame) {
  const double far = random.uniform() < 0.1 ? 100.0 : 1.0;
  Eigen::VectorXd z(frame.origin.size());
  for (double& value : z) {
    value = far * frame.unit * random.normal();
  }
  return frame.origin + frame.basis * z;
}

Eigen::VectorXd random_direction(RandomStream& random, Eigen::Index d) {
  Eigen::VectorXd direction(d);
  for (double& value : direction) {
    value = random.normal();
  }
  return direction;
}

TEST(RegionProperties, SectionsAgreeWithMembership) {
  RandomStream random(kSeed);
  int inside_count = 0;
  int outside_count = 0;
  for (std::uint64_t trial = 0; trial < 40; ++trial) {
    SCOPED_TRACE("seed " + std::to_string(kSeed) + ", trial " + std::to_string(trial));
    const Regions regions(random_experiment(random, 1 + static_cast<int>(trial % 4)), trial);
    regions.visit([&](const auto& region, const char* name) {
      for (int line = 0; line < 6; ++line) {
        const Eigen::VectorXd start = random_point(random, regions.frame);
        const Eigen::VectorXd direction =
            regions.frame.basis * random_direction(random, region.dimension()) * regions.frame.unit;
        IntervalList section;
        region.section(start, direction, section);
        for (std::size_t k = 0; k < section.size(); ++k) {
          EXPECT_LT(section[k].lower, section[k].upper) << name;
          if (k > 0) {
            EXPECT_GE(section[k].lower, section[k - 1].upper) << name;
          }
        }
        for (int sample = 0; sample < 20; ++sample) {
          const double t = 2.0 * random.normal();
          const bool near_an_end = std::any_of(section.begin(), section.end(), [t](const Interval& interval) {
            return std::abs(t - interval.lower) < 1e-9 || std::abs(t - interval.upper) < 1e-9;
          });
          if (!near_an_end) {
            const bool contained = region.contains(start + t * direction);
            EXPECT_EQ(inside(section, t), contained) << name << " t = " << t;
            (contained ? inside_count : outside_count) += 1;
          }
        }
      }
    });
  }
  EXPECT_GT(inside_count, 1000);
  EXPECT_GT(outside_count, 1000);
}

TEST(RegionProperties, ExcludedBoxesHoldNoPoint) {
  RandomStream random(kSeed + 1);
  int excluded = 0;
  for (std::uint64_t trial = 0; trial < 40; ++trial) {
    SCOPED_TRACE("seed " + std::to_string(kSeed + 1) + ", trial " + std::to_string(trial));
    const Regions regions(random_experiment(random, 1 + static_cast<int>(trial % 4)), trial);
    regions.visit([&](const auto& region, const char* name) {
      for (int box = 0; box < 30; ++box) {
        const Eigen::VectorXd centre = random_point(random, regions.frame);
        Eigen::MatrixXd generators = regions.frame.basis * (regions.frame.unit * 0.3 * random.uniform());
        if (!region.excludes(centre, generators)) {
          continue;
        }
        ++excluded;
        for (int sample = 0; sample < 20; ++sample) {
          Eigen::VectorXd z(region.dimension());
          for (double& value : z) {
            value = 2.0 * random.uniform() - 1.0;
          }
          EXPECT_FALSE(region.contains(centre + generators * z)) << name;
        }
      }
    });
  }
  EXPECT_GT(excluded, 500);
}

TEST(RegionProperties, OuterBoxesAndEllipsoidsContainEveryPoint) {
  RandomStream random(kSeed + 2);
  int points = 0;
  for (std::uint64_t trial = 0; trial < 12; ++trial) {
    SCOPED_TRACE("seed " + std::to_string(kSeed + 2) + ", trial " + std::to_string(trial));
    const Regions regions(random_experiment(random, 1 + static_cast<int>(trial % 3)), trial);
    regions.visit([&](const auto& region, const char* name) {
      const OuterBox box = outer_box(region, regions.frame, {.relative_tolerance = 0.02, .max_boxes = 3000});
      for (int sample = 0; sample < 200; ++sample) {
        const Eigen::VectorXd point = random_point(random, regions.frame);
        if (region.contains(point)) {
          EXPECT_TRUE((point.array() <= box.upper.array()).all() &&
                      (point.array() >= box.lower.array()).all())
              << name;
          ++points;
        }
        if (regions.sps.contains(point)) {
          EXPECT_TRUE(regions.ellipsoid.contains(point));
        }
      }
    });
  }
  EXPECT_GT(points, 200);
}

/// Exact polygons against membership at random points, and the outer polygon around the exact one.
TEST(RegionProperties, PolygonsAgreeWithMembership) {
  RandomStream random(kSeed + 3);
  int exact = 0;
  for (std::uint64_t trial = 0; trial < 60; ++trial) {
    SCOPED_TRACE("seed " + std::to_string(kSeed + 3) + ", trial " + std::to_string(trial));
    const Regions regions(random_experiment(random, 2), trial);
    PlanarWork work;
    PlanarRegion polygon;
    if (!exact_polygon(regions.lscr, work, polygon) || !polygon.bounded) {
      continue;
    }
    ++exact;
    const auto inside_polygon = [&](const Eigen::Vector2d& p) {
      bool result = false;
      for (int c = 0; c < polygon.components(); ++c) {
        const auto begin = static_cast<std::size_t>(polygon.first_vertex[static_cast<std::size_t>(c)]);
        const auto end = static_cast<std::size_t>(polygon.first_vertex[static_cast<std::size_t>(c) + 1]);
        for (std::size_t k = begin; k < end; ++k) {
          const Eigen::Vector2d& a = polygon.vertices[k];
          const Eigen::Vector2d& b = polygon.vertices[k + 1 < end ? k + 1 : begin];
          if ((a(1) > p(1)) != (b(1) > p(1)) && p(0) < a(0) + (b(0) - a(0)) * (p(1) - a(1)) / (b(1) - a(1))) {
            result = !result;
          }
        }
      }
      return result;
    };
    double shoelace = 0.0;
    for (int c = 0; c < polygon.components(); ++c) {
      const auto begin = static_cast<std::size_t>(polygon.first_vertex[static_cast<std::size_t>(c)]);
      const auto end = static_cast<std::size_t>(polygon.first_vertex[static_cast<std::size_t>(c) + 1]);
      double twice = 0.0;
      for (std::size_t k = begin; k < end; ++k) {
        const Eigen::Vector2d& a = polygon.vertices[k];
        const Eigen::Vector2d& b = polygon.vertices[k + 1 < end ? k + 1 : begin];
        twice += a(0) * b(1) - a(1) * b(0);
      }
      shoelace += std::abs(twice) / 2.0;
    }
    EXPECT_NEAR(shoelace, polygon.area, 1e-9 * polygon.area + 1e-15);
    for (int sample = 0; sample < 400; ++sample) {
      const Eigen::VectorXd point = random_point(random, regions.frame);
      EXPECT_EQ(inside_polygon(point), regions.lscr.contains(point)) << point.transpose();
    }
    if (trial % 8 == 0) {
      const PlanarRegion outer = outer_polygon(regions.lscr, regions.frame, 12);
      ASSERT_TRUE(outer.bounded);
      EXPECT_GE(outer.area, polygon.area * (1.0 - 1e-9));
    }
  }
  EXPECT_GT(exact, 20);
}

/// Levels of arrangements against sorting, with many lines through one point.
TEST(RegionProperties, LevelWalkAgreesWithSorting) {
  RandomStream random(kSeed + 4);
  for (int trial = 0; trial < 100; ++trial) {
    SCOPED_TRACE("seed " + std::to_string(kSeed + 4) + ", trial " + std::to_string(trial));
    const int count = 5 + static_cast<int>(random.uniform() * 60.0);
    const bool lattice = trial % 2 == 1;
    std::vector<Line> lines(static_cast<std::size_t>(count));
    for (Line& line : lines) {
      line.slope = lattice ? std::floor(6.0 * random.uniform()) : random.normal();
      line.intercept = lattice ? std::floor(6.0 * random.uniform()) : random.normal();
    }
    const int k = 1 + static_cast<int>(random.uniform() * count);
    LevelWalkWork work;
    LevelChain chain;
    walk_level(lines, k, -detail::kInfinity, detail::kInfinity, work, chain);
    for (int sample = 0; sample < 50; ++sample) {
      const double x = 4.0 * random.normal();
      std::vector<double> heights;
      for (const Line& line : lines) {
        heights.push_back(line.at(x));
      }
      std::sort(heights.begin(), heights.end());
      const auto piece = std::upper_bound(chain.breaks.begin(), chain.breaks.end(), x) - chain.breaks.begin();
      const Line& line = lines[static_cast<std::size_t>(chain.pieces[static_cast<std::size_t>(piece)])];
      EXPECT_NEAR(line.at(x), heights[static_cast<std::size_t>(k - 1)], 1e-9);
    }
  }
}

/// Residuals of zero noise vanish at the truth: all sums are ties there and the random order decides.
TEST(RegionProperties, TiesAreDecidedByTheRandomOrder) {
  LoopExperiment experiment;
  experiment.noise = LoopNoise::kZero;
  experiment.probes = 40;
  LoopSimulator simulator(experiment);
  ProbedRecord record;
  simulator.simulate(kSeed, 0, record);
  ProbedResiduals residuals;
  plant_residuals(experiment.model, record, 0, {}, residuals);
  BinaryStrings strings;
  strings.resize(19, experiment.probes);
  RandomStream random(kSeed, 5);
  draw_distinct_strings(random, strings);
  int hits = 0;
  constexpr int kDraws = 4000;
  for (int draw = 0; draw < kDraws; ++draw) {
    std::vector<char> ties;
    draw_tie_flags(random, 20, ties);
    LscrRegion region;
    region.assign(residuals, strings, ties, 3, ResidualForm::kPlant);
    const SignCounts counts = region.counts(0, Eigen::Vector2d(-2.0, 1.0));
    EXPECT_EQ(counts.positive, std::count(ties.begin(), ties.end(), 1));
    hits += region.channel_contains(0, Eigen::Vector2d(-2.0, 1.0)) ? 1 : 0;
  }
  const double level = 0.7;
  EXPECT_NEAR(static_cast<double>(hits) / kDraws, level, 5.0 * std::sqrt(level * (1.0 - level) / kDraws));
}

}  // namespace
