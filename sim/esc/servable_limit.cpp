#include "sim/esc/servable_limit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "firmware/board/fake/fake_board.hpp"
#include "firmware/core/motor/limits.hpp"
#include "firmware/core/motor/timing.hpp"
#include "host/base/error.hpp"

namespace rotorloop::sim {
namespace {

// The core holds to its range what is asked for, a share of the parameter (limits.hpp).
template <class Board>
double limit_A(double inductance_H, double bus_V) {
  firmware::Parameters p;
  p.inductance_H = static_cast<float>(inductance_H);
  firmware::LimitConfig limits;
  firmware::configure_range<Board>(p, firmware::sample_s<Board>(), limits);
  const double most_A = firmware::range_limit_A(limits, static_cast<float>(bus_V)) / firmware::kAskedShare;
  return std::floor(10.0 * most_A) / 10.0;
}

struct BoardOfStage {
  std::string_view stage;
  double (*limit_A)(double inductance_H, double bus_V);
};
constexpr std::array<BoardOfStage, 3> kBoards{{{"b_g431b_esc1", limit_A<firmware::FakeBoard>},
                                               {"small_2s_15a", limit_A<firmware::SmallFakeBoard>},
                                               {"high_voltage_14s_120a", limit_A<firmware::HighVoltageFakeBoard>}}};

}  // namespace

ServableLimit servable_limit(const BoardStage& stage, double inductance_H, double bus_V) {
  const auto known = std::find_if(kBoards.begin(), kBoards.end(), [&](const BoardOfStage& b) { return b.stage == stage.name; });
  if (known == kBoards.end()) {
    std::string names;
    for (const BoardOfStage& b : kBoards) names += (names.empty() ? "" : ", ") + std::string(b.stage);
    throw Error({"", fmt::format("the phase current limit of power stage \"{}\" is not known", stage.name), "",
                 fmt::format("use one whose firmware is known: {}", names)});
  }
  return {.stage = stage.name, .inductance_H = inductance_H, .bus_V = bus_V, .limit_A = known->limit_A(inductance_H, bus_V)};
}

std::string servable_text(const ServableLimit& l) {
  return fmt::format("{:.1f} A with {:.3g} uH at {:.1f} V on {}", l.limit_A, 1e6 * l.inductance_H, l.bus_V, l.stage) +
         (l.rotor > 0 ? fmt::format(" (rotor {})", l.rotor) : "");
}

void check_servable(const ServableLimit& l, double asked_A, const std::string& where, const std::string& what) {
  if (asked_A <= l.limit_A) return;
  throw Error({where, fmt::format("{} = {:.4g} A cannot be served: the ESC holds at most {}", what, asked_A, servable_text(l)),
               "its current sensors end too near: ripple and swing of the current need the rest",
               l.limit_A > 0.0 ? fmt::format("give {:.1f} A at most, or take a motor of more inductance or fewer cells", l.limit_A)
                               : "take a motor of more inductance, or fewer cells"});
}

}  // namespace rotorloop::sim
