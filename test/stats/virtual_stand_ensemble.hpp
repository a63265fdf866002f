// The same statistics on the virtual stand: firmware core, blade-element rotor, emulated instruments, the session of hardware.
#pragma once
#include <functional>

#include "test/stats/stand_ensemble.hpp"

namespace rotorloop::stats {

struct VirtualEnsembleOptions {
  std::filesystem::path source, scratch;  // of the repository, for stand and plant file; of the runs' files
  std::uint64_t first = 1;
  std::size_t runs = 50;
  int draws = 150;
  bool drawn_blades = false;  // each run has a blade of its own
  std::function<void(std::uint64_t seed, const stand::StandEstimate&, const test::StandTruth&)> each;
};

// Truth of c_t, c_q and J is the rotor's; of the time constants what a chain without errors shows once, as the speed loop of the ESC is no
// first-order lag. K_v and R are the drive's, R with its switches.
StandEnsemble virtual_stand_ensemble(const VirtualEnsembleOptions& options);

}  // namespace rotorloop::stats
