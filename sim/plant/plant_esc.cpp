#include "sim/plant/plant_esc.hpp"

#include <fmt/format.h>

#include <string>

namespace rotorloop::sim {
namespace {

// The reference drive's phase current limit, where a plant file says nothing.
constexpr double kReferenceLimit_A = 40.0;

// A file of ESC parameters as a user keeps them: what was entered or measured, one phase each.
EscFileValues read_values(const std::filesystem::path& path) {
  const TomlFile file = TomlFile::read(path);
  (void)file.format({1});
  const TomlTable t = file.root();
  EscFileValues v;
  v.resistance_ohm = t.number("resistance_ohm", {0.001, 10.0, "ohm"});
  v.inductance_H = t.number("inductance_H", {5e-7, 1e-2, "H"});
  v.flux_linkage_Wb = t.number("flux_linkage_Wb", {1e-5, 0.1, "Wb"});
  v.pole_pairs = static_cast<int>(t.integer("pole_pairs", 1, 30));
  v.inertia_kg_m2 = t.number("inertia_kg_m2", {1e-9, 1e-2, "kg m^2"});
  v.load_N_m_s2 = t.number("load_N_m_s2", {0.0, 1e-3, "N m s^2"});
  file.refuse_unknown_keys();
  return v;
}

void check_cells(const TomlTable& root, const BoardStage& stage, int cells) {
  if (cells >= stage.least_cells && cells <= stage.most_cells) return;
  std::string fitting;
  for (const BoardStage& b : board_stages())
    if (cells >= b.least_cells && cells <= b.most_cells) fitting = b.name;
  root.table("battery").fail("cells",
                             fmt::format("battery.cells = {} is outside {} to {} cells of the ESCs' power stage {}", cells,
                                         stage.least_cells, stage.most_cells, stage.name),
                             "another battery than the ESCs are made for",
                             fmt::format("choose [esc] stage = \"{}\", or another battery", fitting));
}

}  // namespace

PlantEsc read_plant_esc(const TomlTable& root, int cells) {
  PlantEsc e;
  e.stage = &board_stages().front();
  e.phase_current_limit_A = kReferenceLimit_A;
  e.given = root.has("esc");
  if (e.given) {
    const TomlTable t = root.table("esc");
    if (t.has("stage")) e.stage = find_board_stage(t.choice("stage", {"b_g431b_esc1", "small_2s_15a", "high_voltage_14s_120a"}));
    e.typical = t.has("board") && t.choice("board", {"ideal", "typical"}) == "typical";
    e.own_clock = t.has("clock") && t.choice("clock", {"common", "own"}) == "own";
    if (e.own_clock && !e.typical)
      t.fail("clock", "esc.clock = \"own\" has no meaning with board = \"ideal\"", "", "draw the boards: board = \"typical\"");
    e.phase_current_limit_A = t.number("phase_current_limit_A", {0.1, e.stage->most_phase_A, "A"});
    const std::string parameters = t.has("parameters") ? t.text("parameters") : "motor_file";
    if (parameters == "motor_file" || parameters == "data_sheet" || parameters == "commissioned") {
      e.knowledge = parameters == "motor_file"   ? EscKnowledge::motor_file
                    : parameters == "data_sheet" ? EscKnowledge::data_sheet
                                                 : EscKnowledge::commissioned;
    } else {
      e.knowledge = EscKnowledge::file;
      e.file = read_values(t.file("parameters"));
    }
  }
  check_cells(root, *e.stage, cells);
  return e;
}

std::vector<PlantDriveFault> read_drive_faults(const TomlTable& root) {
  constexpr std::size_t kMostFaults = 64;
  constexpr double kLongest_s = 3600.0;
  std::vector<PlantDriveFault> faults;
  for (const TomlTable& t : root.tables("drive_fault", 0, kMostFaults)) {
    PlantDriveFault f;
    f.rotor = static_cast<int>(t.integer("rotor", 1, 4));
    const std::string kind =
        t.choice("kind", {"phase_open", "shunt_open", "shunt_short", "high_fet_open", "high_fet_short", "low_fet_open", "low_fet_short",
                          "ntc_open", "ntc_short", "weak_magnets", "rotor_lock", "prop_strike", "prop_loss"});
    for (std::size_t k = 0; k < kDriveFaultNames.size(); ++k)
      if (kDriveFaultNames[k] == kind) f.fault.kind = static_cast<DriveFaultKind>(k);
    if (f.fault.kind <= DriveFaultKind::low_fet_short) {
      const std::string phase = t.choice("phase", {"u", "v", "w"});
      f.fault.phase = phase == "u" ? std::uint8_t{0} : phase == "v" ? std::uint8_t{1} : std::uint8_t{2};
    }
    if (f.fault.kind == DriveFaultKind::weak_magnets) f.fault.size = t.number("flux_left", {0.1, 1.0, "1"});
    if (f.fault.kind == DriveFaultKind::prop_strike) f.fault.size = t.number("torque_N_m", {1e-4, 100.0, "N m"});
    f.fault.from_s = t.number("at_s", {0.0, kLongest_s, "s"});
    if (t.has("duration_s")) f.fault.until_s = f.fault.from_s + t.number("duration_s", {1e-3, kLongest_s, "s"});
    faults.push_back(f);
  }
  return faults;
}

}  // namespace rotorloop::sim
