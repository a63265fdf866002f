// What no rotor and no motor can be, looked for before a figure leaves in a verdict or a file. Physics that holds for all of them, or the
// range of propellers that were ever measured; no statistics.
#pragma once
#include <array>
#include <set>
#include <string>
#include <string_view>

#include "bench/stand/evaluate/estimate/stand_result.hpp"

namespace rotorloop::stand {

// Names for `accepted`, each a check that somebody who knows better may take upon himself.
inline constexpr std::array<std::string_view, 5> kCredibilityChecks{"power_balance", "figure_of_merit", "uncertainty", "speed_law",
                                                                    "still_air"};

inline constexpr std::array<double, 2> kFigureOfMerit{0.2, 0.85};  // momentum theory allows 1; propellers of 2 to 30 inches reach these
inline constexpr double kMostRelativeU = 0.3;                      // of a coefficient: beyond, its sign and size are all that is known
// Of thrust and torque over rotor speed, from 2: Reynolds number and twist of the blade bend the square law by less (1.76 to 2.29 on
// measured stands).
inline constexpr double kMostBeyondSquare = 0.4;

// Takes out of `e` what fails, with a fault that says what was seen, what it may come from and what to do: all coefficients where the power
// balance, the figure of merit or the air around the rotor (still_air.hpp) fails, as it does not show which channel is wrong; one
// coefficient where its own u fails or where thrust or torque does not go with the square of the speed; the motor's constants where R is
// not above zero beyond its u.
void refuse_incredible(StandEstimate& e, const StandRun& run, const std::set<std::string, std::less<>>& accepted);

}  // namespace rotorloop::stand
