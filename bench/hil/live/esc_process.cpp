#include "bench/hil/live/esc_process.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "firmware/core/node/parameters.hpp"
#include "host/base/error.hpp"
#include "sim/rotor/bem.hpp"

namespace rotorloop::live {
namespace {

constexpr std::uint64_t kPeriodsPerCoupling = 12;  // as the airframe of a flight: 2 kHz
constexpr std::int64_t kSlice_ns = 1'000'000;      // between two looks at the clock when no frame comes
constexpr std::int64_t kLongestCatchUp_ns = 50'000'000;
constexpr double kReferenceSpeed_rad_s = 900.0;  // near hover: torque over speed squared hardly changes around it

// End of the n-th period: 41 2/3 us each.
std::int64_t period_ns(std::uint64_t periods) { return static_cast<std::int64_t>(periods) * 125'000 / 3; }

firmware::NodeIdentity identity_of(const EscProcessConfig& c, const firmware::ImageHeader& image) {
  firmware::NodeIdentity id;
  id.software_major = image.major;
  id.software_minor = image.minor;
  id.vcs_commit = image.vcs_commit;
  id.image_crc = image.crc;
  id.unique_id = c.unique_id;
  id.feedback_with_voltage = true;
  return id;
}

}  // namespace

double static_load_N_m_s2(const sim::Rotor& rotor, double density_kg_m3) {
  sim::RotorWarmStart start;
  sim::RotorCondition condition;
  condition.omega_rad_s = kReferenceSpeed_rad_s;
  condition.density_kg_m3 = density_kg_m3;
  const sim::RotorLoads loads = sim::solve_rotor(rotor, condition, start);
  return std::fabs(loads.shaft_torque_N_m) / (kReferenceSpeed_rad_s * kReferenceSpeed_rad_s);
}

firmware::Parameters given_parameters(const EscProcessConfig& c) {
  firmware::Parameters p;
  p.node_id = c.node_id;
  p.esc_index = c.esc_index;
  p.require_arming = c.require_arming;
  if (const auto wrong = firmware::check(p)) {
    const firmware::ParameterRange& r = firmware::kParameterRanges[wrong->index];
    throw Error({"esc-sim", fmt::format("{} = {} {} is out of range: {} to {}", r.name, wrong->value, r.unit, wrong->min, wrong->max), "",
                 "give a value within the range"});
  }
  return p;
}

std::array<std::uint8_t, 16> default_unique_id(std::uint8_t esc_index) {
  std::array<std::uint8_t, 16> id{'r', 'o', 't', 'o', 'r', 'l', 'o', 'o', 'p', ' ', 'e', 's', 'c', 0, 0, 0};
  id[15] = esc_index;
  return id;
}

EscProcess::EscProcess(const EscProcessConfig& config, TimedBus& bus)
    : config_(config),
      bus_(bus),
      plant_(sim::read_plant(config.plant)),
      rotors_(sim::read_rotors(plant_)),
      battery_(sim::battery_parameters(plant_)),
      flash_(config.store.generic_string()),
      begun_ns_(bus.now_ns()) {
  const sim::Rotor& rotor = *rotors_[0];
  load_N_m_s2_ = static_load_N_m_s2(rotor, plant_.density_kg_m3);
  const firmware::Parameters p = given_parameters(config_);  // a wrong command line is refused, whatever is stored
  sim::NativeEscConfig e;
  e.drive = sim::drive_parameters(plant_, rotor, 0);
  e.firmware = p;
  e.bus_V = battery_.voltage_V();
  e.seed = config_.seed;
  e.module = config_.esc_index;
  esc_ = std::make_unique<Esc>(sim::NativeEsc(e), firmware::EscNode(p, identity_of(config_, image_)), bus_, sim::EscSetup{},
                               RandomStream(0, 0), flash_.application_pages());
  reset(firmware::ResetCause::power_on);
  busy_until_ = 0;  // a board that was never on leaves the factory with its image
  couple();
}

EscProcess::~EscProcess() = default;

void EscProcess::couple() { esc_->esc().couple_quadratic(load_N_m_s2_, battery_.voltage_V()); }

// A store that holds nothing is that of a new ESC: it has what the command line says. One that is damaged is told and never spins.
firmware::Parameters EscProcess::stored_or_given(firmware::StoreState& state) {
  const firmware::StoredParameters stored = firmware::ParameterStore(esc_->board()).load();
  state = stored.state == firmware::StoreState::corrupt ? stored.state : firmware::StoreState::loaded;
  stored_ = stored.state == firmware::StoreState::loaded;
  return stored.state == firmware::StoreState::empty ? given_parameters(config_) : stored.parameters;
}

// What the reset of the processor does. The drive is not reset: temperatures and a turning rotor stay as they are.
void EscProcess::reset(firmware::ResetCause cause) {
  firmware::StoreState state = firmware::StoreState::loaded;
  const firmware::Parameters p = stored_or_given(state);
  esc_->esc().control() = firmware::EscControl<sim::NativeEsc::Board>(p);
  esc_->esc().board().bridge = false;
  esc_->esc().set_setpoint({});
  updater_.reset();
  const auto image = flash_.to_start();
  if (!image) {
    updater_ = flash_.make_updater(p.node_id, config_.unique_id);
    return;
  }
  image_ = *image;
  ++starts_;
  esc_->start(firmware::EscNode(p, identity_of(config_, image_)), cause);
  if (state != firmware::StoreState::loaded) esc_->node().report_store(state);
}

void EscProcess::run_updater() {
  if (periods_ % Esc::kPeriodsPerPoll != 0) return;
  const auto now_us = static_cast<std::uint64_t>(esc_->esc().time_us());
  while (const auto received = bus_.receive()) updater_->on_frame(received->frame, now_us);
  updater_->poll(now_us);
  while (const auto frame = updater_->next_frame()) bus_.send(*frame);
  if (updater_->finished(now_us)) reset(firmware::ResetCause::software);
}

void EscProcess::run_processor() {
  if (periods_ < busy_until_) return;
  const std::uint64_t before_us = flash_.busy_us();
  if (updater_) {
    run_updater();
  } else {
    esc_->run_node();
    if (esc_->board().restart_wanted()) reset(firmware::ResetCause::software);
  }
  busy_until_ = periods_ + (flash_.busy_us() - before_us) * 24 / 1000;  // periods of 24 kHz
}

// Arrivals are counted from outside: the firmware's own stamp of a command is what its time-out goes by.
void EscProcess::look_at_bridge() {
  const firmware::CommandCounters& c = esc_->node().command_counters();
  const std::uint32_t commands = c.raw_commands + c.rpm_commands + c.fast_setpoints;
  if (commands != commands_) commanded_at_ = periods_;
  commands_ = commands;
  // A self-test follows no command; shorted windings do not switch.
  const bool on =
      esc_->esc().board().bridge && esc_->esc().motor().variables().blocked != firmware::Blocked::self_test && !windings_shorted();
  if (on == bridge_) return;
  bridge_ = on;
  if (!on_bridge) return;
  const double since_s =
      commands == 0 ? std::numeric_limits<double>::quiet_NaN() : static_cast<double>(periods_ - commanded_at_) / sim::kCurrentLoop_Hz;
  on_bridge({on, static_cast<double>(periods_) / sim::kCurrentLoop_Hz, since_s});
}

void EscProcess::step_period() {
  run_processor();
  if (hand_rad_s_) esc_->esc().drive().motor().state().omega_rad_s = *hand_rad_s_;
  esc_->esc().step_current_loop();
  look_at_bridge();
  if (++periods_ % kPeriodsPerCoupling != 0) return;
  battery_.step(esc_->esc().bus_current_A(), static_cast<double>(kPeriodsPerCoupling) / sim::kCurrentLoop_Hz);
  couple();
}

void EscProcess::advance() {
  const auto passed_ns = static_cast<std::int64_t>(static_cast<double>(bus_.now_ns() - begun_ns_) * config_.pace);
  const std::int64_t behind_ns = passed_ns - lost_ns_ - period_ns(periods_);
  if (behind_ns > kLongestCatchUp_ns) lost_ns_ += behind_ns - kLongestCatchUp_ns;
  while (period_ns(periods_ + 1) <= passed_ns - lost_ns_) step_period();
}

std::int64_t EscProcess::next_ns() const { return bus_.now_ns() + kSlice_ns; }
bool EscProcess::operational() const { return !updater_ && esc_->node().mode() == protocols::NodeMode::operational; }
std::uint8_t EscProcess::node_id() const { return esc_->node().node_id(); }
int EscProcess::esc_index() const {
  const std::uint8_t index = esc_->node().parameters().esc_index;
  return index == firmware::kNoEscIndex ? -1 : index;
}
const firmware::EscNode& EscProcess::node() const { return esc_->node(); }
firmware::Telemetry EscProcess::telemetry() const { return esc_->esc().telemetry(); }
double EscProcess::omega_rad_s() const { return esc_->esc().omega_rad_s(); }

}  // namespace rotorloop::live
