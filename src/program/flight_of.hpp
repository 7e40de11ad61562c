// SPDX-License-Identifier: Apache-2.0
/// @file
/// The estimate of a scenario by the method its file asks for.
#pragma once

#include "../io/scenario_reader.hpp"
#include "trammel/core/progress.hpp"
#include "trammel/localise/flight_estimate.hpp"
#include "trammel/window/flight.hpp"

namespace trammel::program {

[[nodiscard]] inline localise::FlightEstimate flight_of(const io::ScenarioInput& input,
                                                        const ProgressObserver& observe = {}) {
  const localise::FlightSettings& settings = input.settings;
  if (!input.windows) {
    return localise::estimate_flight(input.scenario, settings, observe);
  }
  return {.estimate = window::estimate_flight(input.scenario,
                                              {.windows = *input.windows,
                                               .relinearise = settings.relinearise,
                                               .output_step_s = settings.estimate.output_step_s},
                                              observe),
          .statement = {}};
}

}  // namespace trammel::program
