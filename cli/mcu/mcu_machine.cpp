#include "cli/mcu/mcu_machine.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstring>

#include "host/base/error.hpp"
#include "sim/drive/boards.hpp"
#include "sim/plant/motor_file.hpp"

namespace rotorloop::cli {
namespace {

using namespace mcu;
using namespace mcu::g431;

constexpr double kSlice_s = 1e-3;
constexpr double kPulsePeriod_s = 2.5e-3;  // RC input at 400 Hz
constexpr uint8_t kUnwritten = 0xA5;       // what RAM holds at power-up: a pattern, as the chip has no promise

sim::DriveParameters drive_of(const RunArguments& o, const BoardPins& pins) {
  const sim::BoardStage* stage = sim::find_board_stage(pins.stage);
  if (stage == nullptr) throw Error({o.board.generic_string(), "stage = \"" + pins.stage + "\" is not known", "", "b_g431b_esc1 is one"});
  const sim::MotorFile m = sim::read_motor(o.motor);
  sim::DriveParameters d;
  d.motor = {.resistance_ohm = m.resistance_ohm,
             .inductance_H = {m.inductance_d_H, m.inductance_q_H},
             .flux_linkage_Wb = m.flux_linkage_Wb,
             .pole_pairs = m.pole_pairs,
             .inertia_kg_m2 = m.inertia_kg_m2,
             .static_friction_N_m = m.static_friction_N_m,
             .cogging_N_m = m.cogging_N_m};
  d.inverter = stage->inverter;
  d.sensing = stage->sensing;
  d.thermal = stage->thermal;
  return d;
}

// "1500@0.5" or "@0.5": a value, and a time in seconds.
std::pair<double, double> at(const std::string& option, const std::string& text, bool with_value) {
  const size_t sign = text.find('@');
  double value = 0.0, time_s = -1.0;
  const auto number = [](const std::string& t, double& out) {
    const auto [end, error] = std::from_chars(t.data(), t.data() + t.size(), out);
    return error == std::errc{} && end == t.data() + t.size();
  };
  const bool ok = sign != std::string::npos && number(text.substr(sign + 1), time_s) && time_s >= 0.0 &&
                  (with_value ? number(text.substr(0, sign), value) : text.substr(0, sign) == "button");
  if (!ok)
    throw Error({option, "\"" + text + "\" is not understood", "",
                 with_value ? "write microseconds, @ and seconds: 1500@0.5" : "write the button, @ and seconds: button@0.5"});
  return {value, time_s};
}

BoardPins board_of(const RunArguments& o) { return read_board(TomlFile::read(o.board)); }

void load(Chip& chip, const std::vector<ElfFile>& files) {
  chip.power_up(kUnwritten);
  for (const ElfFile& file : files)
    for (const ElfSection& s : file.sections)
      if (uint8_t* to = s.bytes.empty() ? nullptr : chip.memory(s.load_address, static_cast<uint32_t>(s.bytes.size())))
        std::copy(s.bytes.begin(), s.bytes.end(), to);
  // Without anything at the start of flash the first program is started as a bootloader would start it.
  uint32_t first_word = 0;
  std::memcpy(&first_word, chip.memory(kFlashBase, 4), 4);
  chip.core().reset(first_word == ~0u ? vector_table(files.front(), stm32g431_memories()).address : 0);
}

}  // namespace

McuMachine::McuMachine(const RunArguments& o, const std::vector<ElfFile>& files, Chip& chip)
    : EscBoard(board_of(o), drive_of(o, board_of(o)), chip, o.seed), bus({}), chip_(chip), medium_(bus, chip.blocks().fdcan, true) {
  outside = &bus.attach({.name = "outside"});
  chip.lenient = o.lenient;
  load(chip, files);
  press(false);
  drive().set_bus_V(o.supply_V);
  drive().set_load({o.load_N_m_s2, 0.0});
  plan(o);
  if (o.uart == "-") uart_ = stdout;
  if (!o.uart.empty() && o.uart != "-") uart_ = std::fopen(o.uart.c_str(), "wb");
  if (!o.uart.empty() && uart_ == nullptr)
    throw Error({o.uart, "cannot be written", "", "give another file with --uart, or - for the terminal"}, ExitCode::device);
  begin_trace(o);
}

McuMachine::~McuMachine() {
  if (uart_ != nullptr && uart_ != stdout) std::fclose(uart_);
  if (trace_ != nullptr) std::fclose(trace_);
}

void McuMachine::plan(const RunArguments& o) {
  constexpr double kPress_s = 0.1;
  for (const std::string& text : o.presses) {
    const double from_s = at("--press", text, false).second;
    events_.push_back({from_s, true, true});
    events_.push_back({from_s + kPress_s, true, false});
  }
  std::vector<std::pair<double, double>> pulses;
  for (const std::string& text : o.pulses) pulses.push_back(at("--pulse", text, true));
  std::sort(pulses.begin(), pulses.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  for (size_t n = 0; n < pulses.size(); ++n) {
    const double until_s = n + 1 < pulses.size() ? pulses[n + 1].second : o.for_s;
    for (double t = pulses[n].second; t < until_s; t += kPulsePeriod_s) {
      events_.push_back({t, false, true});
      events_.push_back({t + pulses[n].first * 1e-6, false, false});
    }
  }
  std::stable_sort(events_.begin(), events_.end(), [](const Event& a, const Event& b) { return a.at_s < b.at_s; });
}

End McuMachine::run_until(double time_s) {
  while (chip_.time_s() < time_s) {
    double next_s = std::min(time_s, chip_.time_s() + kSlice_s);
    if (next_event_ < events_.size()) next_s = std::min(next_s, std::max(events_[next_event_].at_s, chip_.time_s()));
    const End end = chip_.run_until(std::max(chip_.cycle_at(next_s), chip_.cycle() + 1));
    if (end != End::at_cycle) return end;
    advance();
    for (; next_event_ < events_.size() && events_[next_event_].at_s <= chip_.time_s(); ++next_event_) {
      const Event& e = events_[next_event_];
      e.press ? press(e.high) : set_pwm_input(e.high);
    }
  }
  return End::at_cycle;
}

void McuMachine::on_uart(uint32_t, uint8_t byte) {
  ++uart_bytes;
  if (uart_ != nullptr) std::fputc(byte, uart_);
}

// Value change dump (IEEE 1364, 18): nanoseconds; z is a pin that the chip does not drive.
void McuMachine::begin_trace(const RunArguments& o) {
  if (o.trace.empty()) return;
  trace_ = std::fopen(o.trace.c_str(), "w");
  if (trace_ == nullptr)
    throw Error({o.trace.generic_string(), "cannot be written", "", "give another file with --trace"}, ExitCode::device);
  fmt::print(trace_, "$timescale 1 ns $end\n$scope module stm32g431 $end\n");
  for (uint32_t pin = 0; pin < 112; ++pin) fmt::print(trace_, "$var wire 1 p{} {} $end\n", pin, pin_name(pin));
  fmt::print(trace_, "$upscope $end\n$enddefinitions $end\n");
}

void McuMachine::on_pin(uint32_t pin, bool driven, bool high) {
  EscBoard::on_pin(pin, driven, high);
  if (trace_ != nullptr)
    fmt::print(trace_, "#{}\n{}p{}\n", static_cast<int64_t>(chip_.time_s() * 1e9 + 0.5), !driven ? 'z' : high ? '1' : '0', pin);
}

StackDepth stack_depth(Chip& chip, const std::vector<ElfFile>& files) {
  const VectorTable table = vector_table(files.back(), stm32g431_memories());
  uint32_t floor = kSramBase;
  for (const ElfFile& file : files)
    for (const ElfSection& s : file.sections)
      if (s.writable && s.run_address >= kSramBase && s.run_address + s.size_bytes < table.stack_pointer)
        floor = std::max(floor, s.run_address + s.size_bytes);
  uint32_t at = floor;
  while (at < table.stack_pointer && chip.memory(at, 1) != nullptr && *chip.memory(at, 1) == kUnwritten) ++at;
  return {table.stack_pointer - at, table.stack_pointer - floor};
}

}  // namespace rotorloop::cli
