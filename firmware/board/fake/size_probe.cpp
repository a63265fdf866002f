// Instantiates the motor control for the cross build: its size and instruction count are known before any board exists.
#include "firmware/board/fake/fake_board.hpp"
#include "firmware/core/motor/hand_watch.hpp"
#include "firmware/core/motor/motor.hpp"

namespace rotorloop::firmware {

// One motor on one board; configuring it at start-up is counted too.
extern Motor<FakeBoard> probe_motor;
Motor<FakeBoard> probe_motor{Parameters{}};
extern FakeBoard probe_board;
FakeBoard probe_board;

extern HandWatch<FakeBoard> probe_watch;
HandWatch<FakeBoard> probe_watch{Parameters{}};

// In flash: it runs with the motor off alone.
extern "C" bool probe_hand_watch() { return probe_watch.on_sample(probe_board, probe_motor.variables()); }

extern "C" void probe_sample_interrupt() { probe_motor.on_sample(probe_board); }

}  // namespace rotorloop::firmware
