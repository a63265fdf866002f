// The program of an ESC on the ST B-G431B-ESC1: board, node, motor control, and the endless loop around them.
#include "firmware/app/b_g431b_esc1/faults.hpp"
#include "firmware/app/b_g431b_esc1/program.hpp"
#include "firmware/board/g431/cortex.hpp"
#include "firmware/update/image.hpp"

namespace rotorloop::b_g431b_esc1 {

constinit EscBoard the_board;
constinit Control* the_control = nullptr;

namespace {

using firmware::NodeIdentity;

// Name, version and CRC as the header of the image in flash has them.
NodeIdentity identity() {
  NodeIdentity id{.name = "org.rotorloop.b_g431b_esc1", .unique_id = g431::unique_id()};
  std::array<std::uint8_t, firmware::kImageFieldBytes> head{};
  firmware::ImageHeader h;
  if (!g431::read_flash(kImageOffset, head) || firmware::parse_image(head, h) != firmware::ImageFault::none) return id;
  id.software_major = h.major;
  id.software_minor = h.minor;
  id.vcs_commit = h.vcs_commit;
  id.image_crc = h.crc;
  return id;
}

// One line over the wire of the debugger.
void tell(const StartReport& report, const FaultRecord& fault) {
  g431::TextOut& out = the_board.text();
  out.put("rotorloop clocks ");
  out.put_hex(static_cast<std::uint32_t>(report.clocks));
  out.put(" adc ");
  out.put_hex(static_cast<std::uint32_t>(report.adc));
  out.put(report.can ? " can" : " no can");
  if (fault.magic != 0) {
    out.put(" fault ");
    out.put_hex(fault.exception);
    out.put(" at ");
    out.put_hex(fault.pc);
  }
  out.put("\r\n");
}

// The same over the bus: which exception, and where.
firmware::TextLine last_run(const StartReport& report, const FaultRecord& fault) {
  if (!report.ok())
    return firmware::TextLine("board did not start: clocks ")
        .add(static_cast<std::int32_t>(report.clocks))
        .add(", converters ")
        .add(static_cast<std::int32_t>(report.adc));
  if (the_board.reset_cause() == firmware::ResetCause::watchdog) return "restarted by a watchdog";
  if (fault.magic == 0) return {};
  return firmware::TextLine("restarted after exception ")
      .add(static_cast<std::int32_t>(fault.exception))
      .add(" at ")
      .add_hex(fault.pc)
      .add(", status ")
      .add_hex(fault.cfsr);
}

// More than a period of the sample interrupt, which wakes the core.
constexpr std::uint64_t kAwake_us = 50;

[[noreturn]] void run(firmware::EscFirmware<EscBoard>& esc) {
  std::uint64_t next_us = 0;
  bool pressed = false;
  for (;;) {
    const std::uint64_t now_us = the_board.time_us();
    if (now_us < next_us) {
      // The core sleeps between sample interrupts; for the last of them before a poll it stays awake, so that no poll is late.
      if (next_us - now_us > kAwake_us) g431::wait_for_interrupt();
      continue;
    }
    next_us = now_us + firmware::kPoll_us;
    const bool down = the_board.button();
    if (down && !pressed) esc.application().node().on_button();
    pressed = down;
    esc.poll(the_board);
    the_board.led(esc.application().node().armed());
    the_board.end_of_turn();
  }
}

}  // namespace
}  // namespace rotorloop::b_g431b_esc1

extern "C" {

int main();
void can_interrupt();

void can_interrupt() { rotorloop::b_g431b_esc1::the_board.on_can_interrupt(); }

int main() {
  using namespace rotorloop::b_g431b_esc1;
  const StartReport report = the_board.start();
  const FaultRecord fault = take_fault_record();
  if (fault.magic != 0) keep_fault_record(fault);
  tell(report, fault);
  static rotorloop::firmware::EscFirmware<EscBoard> esc(the_board, identity());
  the_control = &esc.control();
  if (!report.ok()) esc.application().node().hold_initialization(true);
  esc.application().node().report_at_start(last_run(report, fault));
  the_board.start_sampling();
  run(esc);
}

}  // extern "C"
