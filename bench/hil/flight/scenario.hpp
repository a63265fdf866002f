// A scenario file: what to fly, with what, how often, which faults strike, and what counts as passed. Reading it is the
// only place where a scenario is checked; everything behind it may rely on what the comments here promise.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bench/hil/controllers/external.hpp"
#include "bench/hil/controllers/variant.hpp"

namespace rotorloop::hil {

struct FlightPlan {
  std::string name;                  // [A-Za-z0-9_-]+, unique: it names a folder
  std::filesystem::path trajectory;  // exists
  std::vector<std::string> effects;  // ids of effects that `rotorloop-studies effects` shows in this flight; unchecked, `hil` ignores them
};

// Backend names as text ("virtual:"). Only `virtual:` is built in, as a scenario is one process; reading refuses anything else.
struct BusChoice {
  std::string esc = "virtual:";
  std::string state = "virtual:";
  double pace = 0.0;  // seconds of flight per second of real time, 0.01 to 10; 0: lockstep, as fast as it goes
};

// native: firmware core on a simulated drive. lag: a first-order RPM lag (ablation [ablation].esc_lag_s), no current loop.
// emulated: the bytes of the program on an emulated chip. `external` is a known word that reading refuses until it is built in.
enum class EscKind : std::uint8_t { native, lag, emulated };
std::string_view esc_kind_name(EscKind kind);

struct EscChoice {
  std::array<EscKind, 4> kind{EscKind::native, EscKind::native, EscKind::native, EscKind::native};
  std::filesystem::path elf;                                          // program of the emulated ones; empty: not given
  std::filesystem::path board = "vehicles/boards/b_g431b_esc1.toml";  // its pins
  int fast_channel_Hz = 1000;                                         // 0: DroneCAN commands only; else 250, 500 or 1000
  bool emulated() const { return std::find(kind.begin(), kind.end(), EscKind::emulated) != kind.end(); }
};

enum class FaultKind : std::uint8_t {
  esc_silent,     // one ESC's controller stops (power or firmware lost): it neither drives nor talks
  node_silent,    // one ESC's bus connection is cut: it drives on what it knows and runs into its time-out
  bus_babble,     // a node saturates the bus with frames of the highest priority
  frame_drop,     // frames vanish with `probability`
  frame_corrupt,  // frames are hit by an error frame with `probability` (and are sent again by CAN rules)
};
std::string_view fault_kind_name(FaultKind kind);
enum class BusName : std::uint8_t { esc, state };
std::string_view bus_name(BusName bus);

struct Fault {
  FaultKind kind = FaultKind::esc_silent;
  double at_s = 0.0;
  double duration_s = 0.0;     // 0: until the end of the flight
  int rotor = 0;               // 1..4 for esc_silent and node_silent, else 0
  BusName bus = BusName::esc;  // for the bus faults
  double probability = 1.0;    // for frame_drop and frame_corrupt, (0, 1]
  std::string flight;          // empty: in every flight
};

// Which length of the error vector is meant: its 3-D norm, or the magnitude of its vertical component.
enum class ErrorAxis : std::uint8_t { norm_3d, z };
std::string_view axis_name(ErrorAxis axis);  // "3d", "z"

struct ErrorLimit {
  std::string flight;
  Variant variant = Variant::pd_ff;
  double max_cm = 0.0;
  ErrorAxis axis = ErrorAxis::norm_3d;
};
struct ReductionLimit {
  std::string flight;
  Variant from = Variant::pd_ff, to = Variant::pd_ff;  // different
  double min_percent = 0.0;
  ErrorAxis axis = ErrorAxis::norm_3d;
};
struct BusLoadLimit {
  double max_percent = 0.0;
  std::optional<BusName> bus;  // none: holds for both
};
struct Limits {
  std::vector<ErrorLimit> error;
  std::vector<ReductionLimit> reduction;
  std::vector<BusLoadLimit> bus_load;
};

// A published figure printed beside ours; it never enters the verdict.
struct PublishedError {
  std::string flight;
  Variant variant = Variant::pd_ff;
  double error_cm = 0.0;
  ErrorAxis axis = ErrorAxis::norm_3d;
  std::string source;
};

enum class BusModel : std::uint8_t { virtual_bus, direct };

// Switches that take one thing away to show what it is worth. Anything but the defaults is reported as a warning.
struct Ablation {
  bool latency_compensation = true;      // false: the estimator takes each pose as measured on arrival
  bool drift = true;                     // false: the pose sensor's slow drift is off
  BusModel bus = BusModel::virtual_bus;  // direct: set-points reach the ESCs without a bus
  double esc_lag_s = 0.0;                // time constant of EscKind::lag; > 0 exactly when an ESC is of that kind
};
std::vector<std::string> ablation_texts(const Ablation& a);  // one sentence for each switch off its default

struct Scenario {
  std::filesystem::path path;  // of the file itself
  std::string name;
  std::filesystem::path plant, vehicle, gains;  // exist
  std::filesystem::path vehicle_given;          // flown instead of the file's vehicle (then also in `vehicle`); empty: none
  std::vector<std::filesystem::path> files;     // every file it names, itself first; also those of flights left out later
  std::vector<std::uint64_t> seeds;             // >= 1, unique, in file order
  std::vector<Variant> variants;                // >= 1, unique
  std::vector<ExternalController> external;     // unique names; those of `variants` that are not ours are all here
  std::vector<FlightPlan> flights;              // >= 1
  BusChoice bus;
  EscChoice esc;
  std::vector<Fault> faults;
  Limits limits;
  std::vector<PublishedError> published;
  Ablation ablation;
  int airframe_Hz = 2000;  // rigid body and rotor aerodynamics; 1000, 2000, 4000 or 8000
};

// "lockstep", "realtime" or a number -> BusChoice::pace; nothing for any other text.
std::optional<double> parse_pace(std::string_view text);
inline constexpr const char* kPaceWords = "lockstep, realtime, or seconds of flight per second of real time, 0.01 to 10";

// Throws Error (ExitCode::usage) with file, line, key, value, range and remedy.
Scenario read_scenario(const std::filesystem::path& path);

// "1..10", "3", "1,4,7..9" -> seeds in that order; a bare count N given as "N" means exactly seed list 1..N.
// Throws Error naming the argument. (What the option --seeds accepts.)
std::vector<std::uint64_t> parse_seeds(std::string_view text);
// "pd_ff,pd_ff_drag" -> variants, ours and `external` ones; throws Error that lists the known names.
std::vector<Variant> parse_variants(std::string_view text, const std::vector<ExternalController>& external = {});

}  // namespace rotorloop::hil
