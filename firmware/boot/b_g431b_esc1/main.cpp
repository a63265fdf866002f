// The bootloader of the ST B-G431B-ESC1: clocks, watchdog, bus, flash, and firmware/boot/bootloader.hpp around them. It takes no interrupt:
// filters let through what is for this node alone, and the controller's three places are emptied in each turn of the loop.
#include "firmware/app/b_g431b_esc1/memory_map.hpp"
#include "firmware/app/b_g431b_esc1/pins.hpp"
#include "firmware/board/g431/cortex.hpp"
#include "firmware/board/g431/fdcan.hpp"
#include "firmware/board/g431/information.hpp"
#include "firmware/board/g431/pwr.hpp"
#include "firmware/board/g431/timer.hpp"
#include "firmware/board/g431/watchdog.hpp"
#include "firmware/boot/b_g431b_esc1/boot_start.hpp"
#include "firmware/boot/bootloader.hpp"
#include "firmware/core/node/parameter_store.hpp"
#include "firmware/update/release_key.hpp"

namespace rotorloop::b_g431b_esc1 {
namespace {

using firmware::BootStage;
using firmware::Handover;

// Every access feeds the watchdog: the longest, the erase of a page, takes 25 ms. Between two of them a signature is checked, 40 ms of 100.
constexpr std::uint32_t kBootIwdgReload = 239;
static_assert((kBootIwdgReload + 1) * g431::kIwdgDivider * 1000 / g431::kLsiFastest_Hz >= 100);
template <std::uint32_t kFirstPage, std::uint32_t kPages>
struct Pages {
  static constexpr std::uint32_t kFlashPageBytes = g431::kPageBytes;
  bool flash_read(std::uint32_t page, std::uint32_t offset, std::span<std::uint8_t> out) const {
    g431::feed_iwdg();
    return page < kPages && g431::read_flash((kFirstPage + page) * kFlashPageBytes + offset, out);
  }
  // Never a page of this program.
  bool flash_erase(std::uint32_t page) {
    g431::feed_iwdg();
    return page < kPages && kFirstPage + page >= kBootloaderPages && g431::erase_page(kFirstPage + page, nullptr);
  }
  bool flash_program(std::uint32_t page, std::uint32_t offset, std::uint64_t word) {
    g431::feed_iwdg();
    return page < kPages && kFirstPage + page >= kBootloaderPages &&
           g431::program_word((kFirstPage + page) * kFlashPageBytes + offset, word, nullptr);
  }
};
using WholeFlash = Pages<0, g431::kPages>;
using ParameterFlash = Pages<kParameterPage, 2>;
using Boot = firmware::Bootloader<WholeFlash>;

constexpr firmware::UpdateKey kKey = firmware::ROTORLOOP_UPDATE_KEY;  // by the build
static_assert(kKey.kind != firmware::KeyKind::release || firmware::kHasReleaseKey, "give the build -DROTORLOOP_RELEASE_KEY=PUBLIC.pem");

constinit g431::Fdcan can;
constinit g431::Microseconds clock;
constinit WholeFlash flash;

std::uint8_t stored_id() {
  ParameterFlash pages;
  const float id = firmware::ParameterStore(pages).value(firmware::parameter_hash("node_id")).value_or(0.0f);
  return id >= 1.0f && id <= 125.0f ? static_cast<std::uint8_t>(id) : std::uint8_t{0};
}

bool start_board() {
  g431::rcc().apb1enr1.set(g431::rcc_bits::kPwr);
  g431::pwr().cr3.set(g431::pwr_bits::kUcpdDeadBatteryOff);  // its pull-downs lie on two pins of ours
  const bool clocks = g431::start_clocks() == g431::ClockFault::none;
  g431::start_iwdg(kBootIwdgReload);
  g431::start_microseconds();
  g431::make_output(kLed, !kLedOnAt);
  g431::make_output(kCanTermination, kCanTerminated);
  g431::make_output(kCanShutdown, kCanRunsAt);
  g431::make_input(kButton, g431::Pull::up);
  g431::make_alternate(kCanTx, kCanFunction);
  g431::make_alternate(kCanRx, kCanFunction);
  return clocks && can.start(kCanBitRate);
}

// Requests and answers for this node, and, while it has no id, what allocators say.
void hear_only(std::uint8_t own_id) {
  constexpr std::uint32_t kService = 1u << 7u;
  const CanFilter for_us{.id = std::uint32_t{own_id} << 8u | kService, .mask = 0x7Fu << 8u | kService, .extended = true};
  const CanFilter allocators{
      .id = std::uint32_t{protocols::Allocation::kType.id} << 8u, .mask = 0xFFFFu << 8u | kService, .extended = true};
  can.set_filters({own_id != 0 ? &for_us : &allocators, 1});
}

[[noreturn]] void leave(firmware::BootStep step, const Boot& boot, const firmware::BootConfig& config) {
  Handover h{.failures = boot.installed_another() ? std::uint8_t{0} : config.failures, .cause = config.cause};
  if (step == firmware::BootStep::start) h.stage = BootStage::start;
  write_handover(h);
  // What was said last is still in the controller: three frames, unless nobody acknowledges them.
  for (const std::uint64_t until = clock.now() + 2'000; !can.all_sent() && clock.now() < until;) g431::feed_iwdg();
  reset_chip();
}

void serve_bus(Boot& boot, std::uint64_t now_us, std::uint64_t& recover_us) {
  can.on_interrupt(now_us);
  while (const auto received = can.receive()) boot.on_frame(received->frame, now_us);
  boot.poll(now_us);
  while (can.ready()) {
    const auto frame = boot.next_frame();
    if (!frame) break;
    can.send(*frame);
  }
  if (can.state() != BusState::bus_off || now_us < recover_us) return;
  recover_us = now_us + 10'000;
  can.recover();
}

firmware::BootConfig configuration() {
  firmware::BootConfig c;
  const Handover before = read_handover();
  c.cause = g431::take_reset_cause();
  // The second reset of an entry that did not come about has no cause of its own.
  c.failures = firmware::failures_after(c.cause, before);
  write_handover({.failures = c.failures, .cause = c.cause});
  c.button = !g431::read_pin(kButton);
  c.updater.name = "org.rotorloop.b_g431b_esc1";
  c.updater.unique_id = g431::unique_id();
  c.updater.own_id = stored_id();
  c.updater.key = kKey;
  c.updater.layout = kUpdateLayout;
  return c;
}

}  // namespace
}  // namespace rotorloop::b_g431b_esc1

extern "C" int main();

int main() {
  using namespace rotorloop::b_g431b_esc1;
  using namespace rotorloop;
  const bool on_bus = start_board();
  static const firmware::BootConfig config = configuration();
  static Boot boot(flash, config);
  std::uint64_t recover_us = 0;
  std::uint8_t heard_as = 0xFF;
  for (;;) {
    g431::feed_iwdg();
    clock.keep();
    const std::uint64_t now_us = clock.now();
    if (heard_as != boot.updater().own_id()) hear_only(heard_as = boot.updater().own_id());
    if (on_bus) serve_bus(boot, now_us, recover_us);
    g431::write_pin(kLed, ((now_us >> 18u) & 1u) != 0 ? kLedOnAt : !kLedOnAt);
    const firmware::BootStep step = boot.next(now_us);
    if (step != firmware::BootStep::stay) leave(step, boot, config);
  }
}
