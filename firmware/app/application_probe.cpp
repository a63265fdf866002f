// Instantiates the whole ESC for the cross build. A board's program looks like this, with its own board and an endless loop.
#include "firmware/app/esc_application.hpp"
#include "firmware/board/fake/fake_esc_board.hpp"

namespace rotorloop::firmware {

extern FakeEscBoard probe_board;
FakeEscBoard probe_board;
extern EscFirmware<FakeEscBoard> probe_esc;
EscFirmware<FakeEscBoard> probe_esc(probe_board, NodeIdentity{});

extern "C" void probe_sample_interrupt() { probe_esc.on_sample(probe_board); }
extern "C" void probe_main_loop() { probe_esc.poll(probe_board); }

}  // namespace rotorloop::firmware
