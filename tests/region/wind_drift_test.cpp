#include "trammel/region/wind_drift.hpp"
#include <gtest/gtest.h>
#include <cstdio>
#include "trammel/core/random.hpp"
#include "trammel/region/prediction.hpp"
#include "trammel/region/support.hpp"
using namespace trammel;
using namespace trammel::region;
TEST(P, Q) {
  for (int conv = 0; conv < 3; ++conv)
    for (int n = 0; n < 3; ++n)
      for (int k = 0; k < 4; ++k) {
        WindFlight f;
        if (conv == 0) f.wind_step_rad = 8;
        if (conv == 2) f.max_steps = 260;
        SplitMix64 r(2013);
        WindDraws d;
        draw_wind(r, f, WindNoise(n), d);
        WindResult w;
        if (conv < 2) {
          PrintedCorrection c;
          c.kind = WindCorrection(k);
          w = fly_as_printed(f, c, d);
        } else {
          DwellCorrection c;
          c.kind = WindCorrection(k);
          w = fly_with_dwell(f, c, d);
        }
        printf("%d %d %d %.17g steps %d X %.17g Y %.17g est %.17g time %g\n", conv, n + 1, k,
               w.mean_deviation_m, w.steps, w.x_m, w.y_m, w.estimate, w.time_s);
      }
}
