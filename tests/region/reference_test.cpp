// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <gtest/gtest.h>
#include "example_data.hpp"
#include "trammel/region/lscr.hpp"
#include "trammel/region/planar.hpp"
#include "trammel/region/sps.hpp"
#include "trammel/region/self_normalised.hpp"
using namespace trammel; using namespace trammel::region; using namespace trammel::test;
TEST(Probe, Look) {
  for (int which = 0; which < 2; ++which) {
    ExampleData d = which == 0 ? small_example() : example_2();
    printf("y0.. %.17g %.17g %.17g last %.17g\n", d.record.y(1), d.record.y(2), d.record.y(3), d.record.y(d.record.y.size()-1));
    PlantModel m = example_model();
    std::vector<char> ties(d.strings.count(), 0);
    for (auto terms : {KnownTerms::kPrinted, KnownTerms::kOnce}) {
      ProbedResiduals r; prediction_residuals(m, d.record, terms, r);
      LscrRegion g; g.assign(r, d.strings, ties, d.excluded, ResidualForm::kPrediction);
      Eigen::Vector2d th(1, 3.6);
      auto c0 = g.counts(0, th), c1 = g.counts(1, th);
      printf("counts %d %d %d %d\n", c0.positive, c0.negative, c1.positive, c1.negative);
      PlanarWork w; PlanarRegion out; bool ok = exact_polygon(g, w, out);
      PlantImage im = plant_image(out, m);
      printf("ok %d area %.17g x [%.17g %.17g] n %zu  area_ab %.17g a [%.17g %.17g]\n", ok, out.area, out.lower(0), out.upper(0), out.vertices.size(), im.area, im.outline.lower(0), im.outline.upper(0));
      for (auto& v : out.vertices) printf("   %.17g %.17g\n", v(0), v(1));
      IntervalList l; g.channel_section(1, Eigen::Vector2d(1,0), Eigen::Vector2d(0,1), w.sweep, l);
      for (auto& i : l) printf(" sec (%.17g %.17g)\n", i.lower, i.upper);
      if (terms == KnownTerms::kOnce) { SelfNormalisedRegion s; s.assign(r, .025, which ? 480.0 : 32.0); IntervalList q; s.channel_section(0, Eigen::Vector2d(0,0), Eigen::Vector2d(1,0), q); for (auto& i : q) printf(" selfnorm (%.17g %.17g)\n", i.lower, i.upper); }
    }
    for (auto kind : {ResidualFilter::Kind::kNone, ResidualFilter::Kind::kMean, ResidualFilter::Kind::kPeriodic}) {
      ProbedResiduals r; plant_residuals(m, d.record, 0, {.kind = kind, .period = 2, .taps = {}}, r);
      LscrRegion g; g.assign(r, d.strings, ties, d.excluded, ResidualForm::kPlant);
      auto e = g.estimate(); printf("IV %.17g %.17g c0 %.17g %.17g\n", e.parameters(0), e.parameters(1), g.constant(0,0), g.constant(0,1));
      Eigen::Vector2d p(-2,1); auto c0 = g.counts(0, p), c1 = g.counts(1, p);
      printf("counts %d %d %d %d\n", c0.positive, c0.negative, c1.positive, c1.negative);
      PlanarWork w; PlanarRegion out; bool ok = exact_polygon(g, w, out);
      printf("ok %d area %.17g [%.17g %.17g] [%.17g %.17g] n %zu comps %d\n", ok, out.area, out.lower(0), out.upper(0), out.lower(1), out.upper(1), out.vertices.size(), out.components());
      IntervalList l;
      for (int c = 0; c < 2; ++c) { g.channel_section(c, Eigen::Vector2d(-2,0), Eigen::Vector2d(0,1), w.sweep, l); for (auto& i : l) printf(" b sec (%.17g %.17g)\n", i.lower, i.upper); }
      SpsRegion s; std::vector<char> t2(d.signs.count(), 0); s.assign(r, d.signs, t2, d.signs_excluded);
      s.section(Eigen::Vector2d(e.parameters(0),0), Eigen::Vector2d(0,1), l); for (auto& i : l) printf(" sps b (%.17g %.17g)\n", i.lower, i.upper);
      printf("greater %d\n", s.count_greater(p));
      auto el = outer_ellipsoid(s); printf("gamma %.17g area %.17g\n", el.gamma(), el.volume());
    }
  }
}
