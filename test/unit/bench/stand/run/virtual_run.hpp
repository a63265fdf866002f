// A run on the virtual stand for tests: the shipped stand file, the reference drive and propeller.
#pragma once
#include <unistd.h>

#include <filesystem>
#include <functional>
#include <string>

#include "bench/stand/run/preparation.hpp"
#include "bench/stand/virtual/virtual_stand.hpp"

namespace rotorloop::test {

inline std::filesystem::path no_shipped_profile(const std::string& name) { return name; }

inline modbus::StandSetup virtual_setup() {
  return modbus::read_stand_setup(std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "devices/virtual/stand.toml", no_shipped_profile);
}

inline virtual_stand::VirtualStandConfig without_errors() {
  virtual_stand::VirtualStandConfig c;
  c.rotor.plant = std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "vehicles/reference_plant.toml";
  c.properties.noise = {};
  c.properties.division = {};
  c.properties.creep_share = 0.0;
  return c;
}

// Everything of one run; the ESC has been found when it is made.
struct VirtualRun {
  explicit VirtualRun(const modbus::StandSetup& s, const virtual_stand::VirtualStandConfig& config,
                      const std::vector<std::string>& sequences, const stand_run::SequenceOptions& options, const std::string& name)
      : setup(s),
        folder(std::filesystem::temp_directory_path() / ("rotorloop_" + name + std::to_string(::getpid()))),
        stand(setup, config),
        tool(stand.bus()),
        table(tool),
        esc(stand_run::find_esc(tool, table, setup, 0, 2.0)),
        files((std::filesystem::remove_all(folder), folder)),
        session(setup, stand_run::make_plan(sequences, options), tool, table, files, session_options()) {}
  ~VirtualRun() { std::filesystem::remove_all(folder); }

  stand_run::SessionOptions session_options() {
    stand_run::SessionOptions o;
    o.esc_pole_pairs = esc.pole_pairs;
    o.duty_node = esc.duty_node();
    o.configured = [this](char configuration) {
      stand.rotor().set_configuration(configuration);
      return true;
    };
    return o;
  }
  void until(const std::function<bool()>& stop, double most_s) {
    for (const double end = stand.now_s() + most_s; !session.done() && stand.now_s() < end && !stop();) stand.run(session, 0.02);
  }

  modbus::StandSetup setup;
  std::filesystem::path folder;
  virtual_stand::VirtualStand stand;
  tools::ToolNode tool;
  tools::EscTable table;
  stand_run::EscFacts esc;
  stand_run::RunFiles files;
  stand_run::Session session;
};

}  // namespace rotorloop::test
