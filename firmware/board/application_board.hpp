// What the main loop of an ESC (firmware/app/esc_application.hpp) needs of a board beside the power stage (board.hpp): the bus, a clock,
// flash, the reset and the watchdog. The text of these concepts is the contract; every board and every fake ends with
// static_assert(ApplicationBoard<…>), a board with its own power stage with static_assert(EscBoard<…>). All of it is called from the
// main loop and never from the sample interrupt; nothing but the flash may block.
#pragma once
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <type_traits>

#include "firmware/board/board.hpp"
#include "protocols/can_controller.hpp"
#include "protocols/can_frame.hpp"

namespace rotorloop::firmware {

template <class Frame>
struct Received {
  Frame frame{};
  std::uint64_t time_us = 0;  // end of the frame on the bus, on the clock of the board; not after the call of receive()
};

enum class ResetCause : std::uint8_t { power_on, pin, software, watchdog, brown_out, unknown };

// CAN FD: only a port with kFd has these.
template <class P>
concept CanFdPort = requires(P p, const CanFdFrame& frame) {
  { p.send(frame) } -> std::same_as<bool>;
  { p.receive_fd() } -> std::same_as<std::optional<Received<CanFdFrame>>>;
};

// A CAN controller with its driver. Received frames wait in a queue that the controller or an interrupt fills, at least 16 of them; a
// full queue drops the newest.
template <class P>
concept CanPort = requires(P p, const P& reader, const CanFrame& frame, std::span<const CanFilter> filters) {
  // True while one more frame can be queued; false while bus off.
  { reader.ready() } -> std::same_as<bool>;
  // Queues a frame. Of those that wait the smallest identifier leaves first, equal identifiers leave in the order of the calls. False,
  // and the frame is lost: not ready().
  { p.send(frame) } -> std::same_as<bool>;
  // The next classic frame of another node, in bus order; never one's own, no remote frames.
  { p.receive() } -> std::same_as<std::optional<Received<CanFrame>>>;
  // Only frames that fit one of these are received from now on; none given: all. False, and nothing changes: more than the controller has.
  { p.set_filters(filters) } -> std::same_as<bool>;
  { reader.state() } -> std::same_as<BusState>;
  // While bus off: begin to wait for the 128 x 11 recessive bits after which the controller takes part again (on an FDCAN: clear INIT).
  // Does nothing where the controller does it by itself.
  { p.recover() } -> std::same_as<void>;
  requires !P::kFd || CanFdPort<P>;
};

template <class P>
concept CanPortReference = CanPort<std::remove_cvref_t<P>>;

template <class B>
concept ApplicationBoard = requires(B b, const B& reader, std::span<std::uint8_t> out, std::uint64_t word) {
  { b.can() } -> CanPortReference;
  // Microseconds since the reset; never runs backwards, does not wrap.
  { reader.time_us() } -> std::same_as<std::uint64_t>;
  // Flash by pages: 0 and 1 hold the parameters, kUpdateRecordPage what an update leaves for the updater that runs after the reset
  // (firmware/update). Programming takes one erased 8-byte word; the calls return when the flash has finished, 22 ms for a page of an
  // STM32G4. They are called with the bridge off. False: refused, or not readable (ECC).
  requires B::kFlashPageBytes >= 2048;
  requires B::kUpdateRecordPage >= 2;
  { reader.flash_read(std::uint32_t{}, std::uint32_t{}, out) } -> std::same_as<bool>;  // page, offset
  { b.flash_erase(std::uint32_t{}) } -> std::same_as<bool>;
  { b.flash_program(std::uint32_t{}, std::uint32_t{}, word) } -> std::same_as<bool>;
  // Why the processor started; the flags of the hardware are read once, before they are cleared.
  { reader.reset_cause() } -> std::same_as<ResetCause>;
  // Resets the processor. On hardware it does not return; a simulated board returns and starts the application anew.
  { b.restart() } -> std::same_as<void>;
  // The watchdog resets the processor when it was not kicked for 50 ms (longer than the erase of a page), and cannot be stopped.
  { b.kick_watchdog() } -> std::same_as<void>;
};

template <class B>
concept EscBoard = Board<B> && ApplicationBoard<B>;

}  // namespace rotorloop::firmware
