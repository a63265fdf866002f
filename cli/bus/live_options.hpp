// What every command on a live bus shares: how long it runs, a recording, and its end by Ctrl-C.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "cli/ending/stop_signals.hpp"
#include "host/bus/timed_bus.hpp"

namespace CLI {
class App;
}

namespace rotorloop::cli {

// Behind every help text on buses.
inline constexpr const char* kBusHelp =
    "bus: mcast:0 (programs on this machine or network), socketcan:can0 (CAN interface of Linux), gsusb: (USB adapter), slcan:/dev/ttyACM0 "
    "(serial adapter), "
    "slcan-server:PATH";

struct LiveOptions {
  double for_s = 0.0;  // 0: until Ctrl-C
  bool for_given = false;
  std::filesystem::path record;
  bool json = false, force = false;
  bool wait = false;  // for a bus that is not there, or went away
};
void add_live_options(CLI::App& command, LiveOptions& options);
void add_for(CLI::App& command, LiveOptions& options, const char* help);  // --for alone
// Throws Error for a time that is none and for a recording that exists.
void check_live_options(const LiveOptions& options);

// Runs `step` until it says that it is done, the time is over, or a signal comes. `step` returns when it wants to be called again at the
// latest (of the bus's clock), or none when it is done; frames that arrive wake it earlier. Returns the signals, for the exit code.
struct LiveEnd {
  bool by_signal = false;
  int exit_code = 0;  // 130 or 143 when a signal cut a time that was asked for; 0 when Ctrl-C is the only end there is
};
LiveEnd run_live(std::span<TimedBus* const> buses, const LiveOptions& options, const std::function<std::optional<std::int64_t>()>& step);

// Opens a bus, waiting for it with --wait; open_recorded() with its recording when one was asked for. The interface in a candump log is
// that of Linux or the adapter's name ("vcan0", "0042001A.1", "mcast0"). The recording is whole when the bus is gone, or after
// finish_recording(), which throws Error when the disk refused.
std::unique_ptr<TimedBus> open_live(const LiveOptions& options, const std::string& bus, const std::string& where);
std::unique_ptr<TimedBus> open_recorded(const LiveOptions& options, const std::string& bus, const std::string& where);
void finish_recording(TimedBus& bus);
std::string interface_name(const std::string& bus);

// What changed on the bus, a line on stderr for each.
void tell_notices(TimedBus& bus);
// "lost: …" on stderr when frames were lost or damaged; silent otherwise.
void tell_losses(TimedBus& bus);

}  // namespace rotorloop::cli
