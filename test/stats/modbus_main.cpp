// Many exchanges over a bad line (scripts/stats modbus). Exit 6 when a wrong value was accepted.
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "test/stats/modbus_study.hpp"

int main(int argc, char** argv) {
  rotorloop::test::ModbusStudy study{.exchanges = 1'000'000};
  bool no_silence = false;
  CLI::App app{"exchanges over a bad RS-485 line: values accepted that the device did not have"};
  app.add_option("--exchanges", study.exchanges, "how many")->check(CLI::Range(1ul, 1'000'000'000ul))->capture_default_str();
  app.add_option("--seed", study.seed, "of the line's faults")->capture_default_str();
  app.add_flag("--no-silence", no_silence, "without the silence after errors: what it protects from");
  CLI11_PARSE(app, argc, argv);
  if (no_silence) study.late_max_ms = study.timeout_ms;
  const auto r = rotorloop::test::run_modbus_study(study);
  fmt::print("{}", r.text());
  return r.wrong_registers + r.wrong_times == 0 ? 0 : 6;
}
