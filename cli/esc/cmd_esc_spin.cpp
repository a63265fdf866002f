// `rotorloop esc spin`: turns one motor, with limits, a dead-man's switch and a stop at every end.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "cli/esc/esc_commands.hpp"
#include "cli/esc/esc_session.hpp"
#include "cli/esc/held_key.hpp"
#include "host/base/error.hpp"
#include "host/tools/esc_table.hpp"
#include "host/tools/spin.hpp"

namespace rotorloop::cli {
namespace {

struct SpinArguments {
  EscOptions esc;
  tools::SpinOptions spin;
  std::optional<int> index;
  std::optional<double> rpm, duty, for_s;
  bool yes = false;
};

void print_row(const tools::EscRow& row, double set_point, bool json, const tools::ToolNode& tool) {
  if (json) {
    auto j = tools::esc_row_json(row, tool);
    j["set_point"] = set_point;
    fmt::print("{}\n", j.dump());
  } else {
    fmt::print("set {:>8.4g}   {:>7} rpm  {:>6.2f} V  {:>6.2f} A  {:>5.1f} °C\n", set_point, row.status.rpm, row.status.voltage_V,
               row.status.current_A, row.status.temperature_K - 273.15f);
  }
  std::fflush(stdout);
}

[[noreturn]] void refuse_to_begin(tools::SpinEnd why, const tools::SpinOptions& o) {
  throw Error(
      {"esc spin", "nothing was armed: " + tools::spin_end_text(why, o), "",
       why == tools::SpinEnd::foreign_commander ? "end the other program or disconnect the autopilot" : "look at: rotorloop esc list"},
      why == tools::SpinEnd::silent ? ExitCode::device : ExitCode::safety);
}

// What was given is checked before it is said what is missing: a value out of range is the worse mistake.
tools::SpinOptions checked(const SpinArguments& o) {
  tools::SpinOptions s = o.spin;
  s.esc_index = o.index.value_or(0);
  s.duty = o.duty.has_value();
  s.value = o.duty ? *o.duty : o.rpm.value_or(0.0);
  s.for_s = o.for_s.value_or(1.0);
  tools::check_spin(s);
  const char* const example = "for example: rotorloop esc spin --index 0 --rpm 3000 --for 5";
  if (o.rpm.has_value() == o.duty.has_value()) throw Error({"--rpm", "give either --rpm or --duty", "", example});
  if (!o.index) throw Error({"--index", "which motor is to turn was not given", "", example});
  if (!o.for_s) throw Error({"--for", "the duration is not given", "", example});
  return s;
}

int spin(SpinArguments o) {
  o.spin = checked(o);
  const bool terminal = ::isatty(STDIN_FILENO) == 1;
  if (!o.yes && !terminal)
    throw Error({"--yes", "the motor would run, and standard input is no terminal to ask for confirmation", "",
                 "give --yes when the propeller is off or the frame is fixed"});
  EscSession session(o.esc);
  tools::ToolNode& tool = session.tool();
  tools::EscTable table(tool);
  tools::Spin motor(tool, table, o.spin);
  session.discover();
  if (const auto why = motor.check_before(); why != tools::SpinEnd::running) refuse_to_begin(why, o.spin);
  std::optional<HeldKey> key;
  if (!o.yes) {
    fmt::print(stderr, "ESC {} (node {}) will run. Is the propeller off, or the frame fixed? Hold SPACE to run it, release to stop.\n",
               o.spin.esc_index, table.of_index(o.spin.esc_index)->node);
    key.emplace();
    if (!tool.run_until(tool.now_ns() + 60'000'000'000, [&] { return key->pressed(tool.now_ns()); })) {
      fmt::print(stderr, "nothing was armed\n");
      return session.stop().asked() ? session.stop().exit_code() : to_int(ExitCode::interrupted);
    }
  }
  motor.begin();
  std::uint64_t shown = 0;
  while (!motor.done()) {
    tool.poll();
    motor.step(!session.stop().asked() && (!key || key->pressed(tool.now_ns())));
    const tools::EscRow* row = table.of_index(o.spin.esc_index);
    if (row != nullptr && row->reports != shown && row->reports % 5 == 0) {
      shown = row->reports;
      print_row(*row, motor.set_point(), o.esc.live.json, tool);
    }
    tool.bus().wait_until(tool.now_ns() + tools::Spin::kCommandPeriod_ns / 4);
  }
  key.reset();
  fmt::print(stderr, "stopped and disarmed: {}; fastest {:.0f} rpm\n", tools::spin_end_text(motor.end(), o.spin), motor.fastest_rpm());
  session.finish();
  if (session.stop().asked()) return session.stop().exit_code();
  return motor.end() == tools::SpinEnd::done || motor.end() == tools::SpinEnd::released ? 0 : to_int(ExitCode::safety);
}

}  // namespace

void add_esc_spin(CLI::App& group, int& exit_code) {
  auto o = std::make_shared<SpinArguments>();
  CLI::App* c = group.add_subcommand("spin", "run one motor with limits, while a key is held");
  add_esc_options(*c, o->esc);
  c->add_option("--index", o->index, "esc_index of the motor, 0 to 15; required");
  c->add_option("--rpm", o->rpm, "speed set-point, RPM, negative for reverse");
  c->add_option("--duty", o->duty, "duty cycle, -1 to 1");
  c->add_option("--for", o->for_s, "duration with ramp, s, 0.1 to 600; required");
  c->add_option("--ramp", o->spin.ramp_s, "ramp time from standstill to the set-point, s")->capture_default_str();
  c->add_option("--max-current", o->spin.most_current_A, "current limit, A; above it the motor is stopped at once")->capture_default_str();
  c->add_option("--max-temperature", o->spin.most_temperature_C, "temperature limit, °C; above it the motor is stopped at once")
      ->capture_default_str();
  c->add_option("--max-rpm", o->spin.most_rpm, "limit of the measured speed, RPM; above it the motor is stopped at once")
      ->capture_default_str();
  c->add_flag("--yes", o->yes, "run without holding a key; only when the propeller is off or the frame is fixed");
  c->footer(
      "On a terminal the motor runs while SPACE is held. It stops and is disarmed at the end of the time, when the key is released, at\n"
      "Ctrl-C, at a limit, when the ESC stops reporting, and when another node sends commands. If this program is killed, the ESC stops "
      "the\n"
      "motor after 250 ms. All other ESCs on the bus get the set-point zero.\n"
      "Example:\n  rotorloop esc spin --index 0 --rpm 3000 --for 5\n"
      "Exit code 4: stopped by a limit, by a fault, or because another node sent commands.");
  c->callback([o, &exit_code] { exit_code = spin(*o); });
}

}  // namespace rotorloop::cli
