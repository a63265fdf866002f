// `rotorloop log`: what is in a flight log, whoever wrote it, what is wrong with it, and the same flight in another format.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bench/sysid/log/check/log_report.hpp"
#include "bench/sysid/log/log_summary.hpp"
#include "bench/sysid/log/mcap_write.hpp"
#include "bench/sysid/log/own_log.hpp"
#include "bench/sysid/log/read_flight.hpp"
#include "bench/sysid/log/ulog_write.hpp"
#include "cli/commands.hpp"
#include "cli/ending/outputs.hpp"
#include "cli/shipped_mapping.hpp"
#include "host/base/error.hpp"
#include "host/base/text_file.hpp"
#include "host/vehicle/effect_catalogue.hpp"
#include "host/vehicle/vehicle_file.hpp"

namespace rotorloop::cli {
namespace {

struct LogArguments {
  std::filesystem::path log, mapping, out, vehicle;
  std::vector<std::filesystem::path> logs;  // of `check`
  bool json = false, force = false;
};

std::optional<log::LogMapping> mapping_of(const std::filesystem::path& given, const std::vector<std::filesystem::path>& logs) {
  const std::filesystem::path path = mapping_or_shipped(given, logs);
  return path.empty() ? std::nullopt : std::optional(log::read_log_mapping(path));
}

log::FlightRecord read(const LogArguments& o, std::vector<log::LogFinding>& notes) {
  const auto mapping = mapping_of(o.mapping, {o.log});
  return log::read_flight(o.log, mapping ? &*mapping : nullptr, &notes);
}

int info(const LogArguments& o) {
  std::vector<log::LogFinding> notes;
  const auto flight = read(o, notes);
  fmt::print("{}", o.json ? log::summary_json(flight, notes) : log::summary_text(flight, notes));
  return 0;
}

int convert(const LogArguments& o) {
  const auto extension = o.out.extension();
  if (extension != ".ulg" && extension != ".csv" && extension != ".mcap")
    throw Error({o.out.generic_string(), "has an ending that names no format to write", "",
                 "let --out end in .csv (flight log of rotorloop, columns in SI units), .ulg (ULog) or .mcap (Foxglove, PlotJuggler)"});
  check_outputs({{"-o", o.out}}, o.force);
  std::vector<log::LogFinding> notes;
  const auto flight = read(o, notes);
  for (const auto& n : notes) fmt::print(stderr, "note: {}: {}\n", n.stream, n.what);
  if (extension == ".csv" && !flight.pose.empty() && !flight.position_W_m.empty())
    fmt::print(stderr, "note: position: not written; a flight log has one position, that of the pose\n");
  write_text_file(o.out, extension == ".ulg"    ? log::ulog_bytes(flight)
                         : extension == ".mcap" ? log::mcap_bytes(flight)
                                                : log::own_log_text(flight));
  return 0;
}

// Every log is judged before one of them ends the command.
int check(const LogArguments& o) {
  const auto mapping = mapping_of(o.mapping, o.logs);
  std::optional<host::VehicleModel> vehicle;
  if (!o.vehicle.empty()) vehicle = host::to_model(host::read_vehicle(o.vehicle, host::builtin_effect_catalogue()));
  std::vector<log::LogReport> reports;
  bool refused = false;
  for (const auto& path : o.logs) {
    std::vector<log::LogFinding> notes;
    log::FlightRecord flight = log::read_flight(path, mapping ? &*mapping : nullptr, &notes);
    reports.push_back(log::report_log(std::move(flight), std::move(notes), vehicle ? &*vehicle : nullptr));
    refused = refused || reports.back().checked.refusal;
  }
  fmt::print("{}", o.json ? log::log_report_json(reports, vehicle.has_value()) : log::log_report_text(reports, vehicle.has_value()));
  return to_int(refused ? ExitCode::data_quality : ExitCode::ok);
}

constexpr const char* kLogHelp = "flight log: CSV, ULog, DataFlash (.BIN), or a run folder that contains flight.csv";

void add_mapping(CLI::App& c, LogArguments& o) { c.add_option("-m,--mapping", o.mapping, kMappingHelp); }

void add_check(CLI::App& group, int& exit_code) {
  auto o = std::make_shared<LogArguments>();
  CLI::App* c = group.add_subcommand("check", "check logs for errors, and list which parameters these flights can determine");
  c->add_option("log", o->logs, kLogHelp)->required();
  add_mapping(*c, *o);
  c->add_option("--vehicle", o->vehicle, "vehicle file: with its mass, geometry and rotor radius two more checks are made");
  c->add_flag("--json", o->json, "one JSON document instead of text");
  c->footer(
      "Examples:\n"
      "  rotorloop log check run/horizontal/pd_ff/1\n"
      "  rotorloop log check eckart00.csv eckart12.csv --mapping vehicles/measured/imrc_cf21bl_bare.mapping.toml\n"
      "Exit code 5: at least one log is refused.");
  c->callback([o, &exit_code] { exit_code = check(*o); });
}

void add_input(CLI::App& c, LogArguments& o) {
  c.add_option("log", o.log, kLogHelp)->required();
  add_mapping(c, o);
}

}  // namespace

void add_log(CLI::App& app, int& exit_code) {
  CLI::App* group = app.add_subcommand("log", "flight logs of rotorloop and other tools: contents, checks, conversion");
  group->require_subcommand(1);
  {
    auto o = std::make_shared<LogArguments>();
    CLI::App* c = group->add_subcommand("info", "list the streams of a log with rate, time span and first values");
    add_input(*c, *o);
    c->add_flag("--json", o->json, "one JSON document instead of a table");
    c->footer(
        "Examples:\n"
        "  rotorloop log info run/horizontal/pd_ff/1\n"
        "  rotorloop log info flight.ulg\n"
        "Without a mapping file, the error message for a log of another tool lists its columns or topics.");
    c->callback([o, &exit_code] { exit_code = info(*o); });
  }
  add_check(*group, exit_code);
  auto o = std::make_shared<LogArguments>();
  CLI::App* c = group->add_subcommand("convert", "convert a flight log to ULog, MCAP or CSV with columns in SI units");
  add_input(*c, *o);
  c->add_option("-o,--out", o->out, "file to write, ending in .csv, .ulg or .mcap")->required();
  add_force(*c, o->force);
  c->footer(
      "Example:\n  rotorloop log convert eckart00.csv --mapping vehicles/measured/imrc_cf21bl_bare.mapping.toml -o eckart00.ulg\n"
      "  rotorloop log convert 00000012.BIN -o flight.mcap");
  c->callback([o, &exit_code] { exit_code = convert(*o); });
  group->footer(
      "Examples:\n  rotorloop log info flight.ulg\n  rotorloop log check run/horizontal/pd_ff/1\nrotorloop --help lists the exit codes.");
}

}  // namespace rotorloop::cli
