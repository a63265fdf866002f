#include "bench/hil/live/emulated_process.hpp"

#include <fmt/format.h>

#include "host/base/error.hpp"

namespace rotorloop::live {
namespace {

constexpr std::int64_t kStep_ns = 500'000;  // as the airframe of a flight: 2 kHz
constexpr std::int64_t kMostBehind_ns = 50'000'000;

}  // namespace

EmulatedEscProcess::EmulatedEscProcess(const EscProcessConfig& config, const sim::EscProgram& program, TimedBus& bus)
    : config_(config),
      bus_(bus),
      plant_(sim::read_plant(config.plant)),
      rotors_(sim::read_rotors(plant_)),
      battery_(sim::battery_parameters(plant_)),
      wire_({}),
      outside_(wire_.attach({.name = "outside"})),
      begun_ns_(bus.now_ns()) {
  if (plant_.esc.stage->name != program.pins.stage)
    throw Error({config.plant.generic_string(),
                 fmt::format("esc.stage is {}: {} is a program for {}", plant_.esc.stage->name, program.elf.filename().generic_string(),
                             program.pins.stage),
                 "", "give another plant with --plant, or leave --elf out"});
  load_N_m_s2_ = static_load_N_m_s2(*rotors_[0], plant_.density_kg_m3);
  sim::NativeEscConfig e;
  e.drive = sim::drive_parameters(plant_, *rotors_[0], 0);
  e.firmware = given_parameters(config_);
  e.bus_V = battery_.voltage_V();
  e.seed = config_.seed;
  e.module = config_.esc_index;
  esc_ = std::make_unique<sim::EmulatedEsc>(program, e, wire_, "chip");
  esc_->couple_quadratic(load_N_m_s2_, battery_.voltage_V());
}

void EmulatedEscProcess::step() {
  while (const auto received = bus_.receive()) outside_.send(received->frame);
  sim::EmulatedEsc* const alone = esc_.get();
  const std::int64_t until_ns = ++steps_ * kStep_ns;
  sim::EmulatedEsc::step_together({&alone, 1}, wire_, until_ns);
  wire_.advance_to(until_ns);
  while (const auto received = outside_.receive()) {
    // Of an extended frame the source is the lowest seven bits; anonymous ones have 0.
    if (const CanFrame& f = received->frame; f.extended && (f.id & 0x7F) != 0) node_id_ = static_cast<int>(f.id & 0x7F);
    bus_.send(received->frame);
  }
  battery_.step(esc_->bus_current_A(), static_cast<double>(kStep_ns) * 1e-9);
  esc_->couple_quadratic(load_N_m_s2_, battery_.voltage_V());
}

void EmulatedEscProcess::advance() {
  const auto passed_ns = static_cast<std::int64_t>(static_cast<double>(bus_.now_ns() - begun_ns_) * config_.pace);
  const std::int64_t behind_ns = passed_ns - lost_ns_ - steps_ * kStep_ns;
  if (behind_ns > kMostBehind_ns) lost_ns_ += behind_ns - kMostBehind_ns;
  while ((steps_ + 1) * kStep_ns <= passed_ns - lost_ns_) step();
}

}  // namespace rotorloop::live
