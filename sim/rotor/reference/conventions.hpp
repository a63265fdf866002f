// The choices on which rotor codes differ while all calling themselves blade-element-momentum. Each is a switch, so that a result
// of another code can be reproduced in its own terms, and so that the price of each choice can be measured. The defaults are
// those of sim/rotor/bem.hpp.
#pragma once

namespace rotorloop::sim {

enum class Inflow {
  annular,      // each annulus balances thrust with momentum (Leishman 2006, ch. 3), Prandtl's loss on the momentum side
  uniform,      // one induced velocity for the whole disk, area pi R^2 (NeuroBEM, arXiv:2106.08015, eq. 5; Bailey, NACA 716)
  circulation,  // bound circulation against the swirl of a helical wake (Drela, QPROP Formulation, 2006); axial flow only
};

// What replaces momentum theory in descent.
enum class Descent {
  ring,      // the empirical mass flow of sim/rotor/inflow.hpp, faded out by edgewise flow
  momentum,  // nothing: Glauert's formula everywhere
  quartic,   // uniform inflow only: vi = vh * quartic(Vz / vh), at least the momentum value, at most 2 vh (NeuroBEM, eq. 18-19)
};

enum class EdgeLoss { none, tip, tip_and_root };

struct RotorConventions {
  Inflow inflow = Inflow::annular;
  Descent descent = Descent::ring;
  EdgeLoss edge_loss = EdgeLoss::tip_and_root;  // of the annular balance; circulation has the tip loss of its wake condition
  bool sheet_spread = true;                     // v^2/8 added to the speed that carries the vortex sheets away (sim/rotor/prandtl.hpp)
  bool swirl = true;                            // induced velocity stands across the relative flow, so that the wake turns
  bool skew = true;                             // Pitt-Peters: more inflow downstream than upstream in edgewise flow
  bool spanwise_drag = true;                    // section drag also opposes the flow along the blade
  bool compressibility = false;                 // lift over sqrt(1 - M^2), Prandtl-Glauert
  double in_plane_factor = 1.0;                 // on the in-plane force; 3.0 in Agilicious, fitted to flights of one vehicle
  double thrust_factor = 1.0;       // on the thrust of the result, not on the balance; 0.9575 in Agilicious: the frame in the wake
  double viscosity_Pa_s = 1.81e-5;  // air at 288 K, ISA
  double sound_speed_m_s = 340.0;
};

}  // namespace rotorloop::sim
