// Temperatures of one motor and its power stage as two chains of two heat capacities: winding - iron - air, and FETs - board -
// air. Resistances and flux follow them: copper +0.393 %/K, channel of a FET +0.45 %/K, NdFeB -0.11 %/K (data sheet
// coefficients of the materials, referred to 25 degC).
#pragma once

namespace rotorloop::sim {

struct ThermalParameters {
  bool follows = false;  // false: every temperature stays where it is
  double air_K = 298.15;
  // Typical of a 2306 motor (8 g of copper, 20 g of iron and magnets) in its propeller's stream, and of a 30 x 40 mm board: estimates.
  double winding_J_K = 3.1, winding_K_W = 1.2;  // heat capacity; resistance to the next node
  double iron_J_K = 9.0, iron_K_W = 2.5;
  double fets_J_K = 0.4, fets_K_W = 1.5;
  double board_J_K = 12.0, board_K_W = 4.0;
};

struct Temperatures {
  double winding_K = 298.15, iron_K = 298.15, fets_K = 298.15, board_K = 298.15;
};

constexpr double kThermalReference_K = 298.15;
constexpr double copper_factor(double temperature_K) { return 1.0 + 3.93e-3 * (temperature_K - kThermalReference_K); }
constexpr double channel_factor(double temperature_K) { return 1.0 + 4.5e-3 * (temperature_K - kThermalReference_K); }
constexpr double magnet_factor(double temperature_K) { return 1.0 - 1.1e-3 * (temperature_K - kThermalReference_K); }

// One step of dt much shorter than the smallest time constant (fets: 0.6 s).
constexpr void advance(const ThermalParameters& p, Temperatures& t, double winding_W, double stage_W, double dt_s) {
  const double to_iron_W = (t.winding_K - t.iron_K) / p.winding_K_W, to_air_W = (t.iron_K - p.air_K) / p.iron_K_W;
  const double to_board_W = (t.fets_K - t.board_K) / p.fets_K_W, off_board_W = (t.board_K - p.air_K) / p.board_K_W;
  t.winding_K += dt_s / p.winding_J_K * (winding_W - to_iron_W);
  t.iron_K += dt_s / p.iron_J_K * (to_iron_W - to_air_W);
  t.fets_K += dt_s / p.fets_J_K * (stage_W - to_board_W);
  t.board_K += dt_s / p.board_J_K * (to_board_W - off_board_W);
}

}  // namespace rotorloop::sim
