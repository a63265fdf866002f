// All comparisons together, and their table.
#include "bench/propeller/oracles/oracles.hpp"

#include <fmt/format.h>

#include <cmath>
#include <iterator>

namespace rotorloop::propeller {

std::vector<OracleRow> rotor_oracles(const std::filesystem::path& data) {
  std::vector<OracleRow> rows;
  const auto append = [&](std::vector<OracleRow> more) {
    rows.insert(rows.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
  };
  append(qprop_oracle(data));
  append(agilicious_oracle(data));
  append(jsbsim_rotor_oracle(data));
  append(jsbsim_drive_oracle(data));
  append(rigid_body_oracle(data));
  return rows;
}

std::string oracle_table(const std::vector<OracleRow>& rows) {
  const auto percent = [](double x) {
    if (x != 0.0 && std::fabs(x) < 1e-5) return fmt::format("{:.1e}", x);
    return fmt::format("{:.3f} %", 100.0 * x);
  };
  std::string s = fmt::format("{:<24}{:<30}{:<34}{:>13}{:>13}{:>12}{:>11}  {}\n", "source", "condition", "quantity", "recorded", "ours",
                              "deviation", "limit", "");
  for (const OracleRow& r : rows)
    s += fmt::format("{:<24}{:<30}{:<34}{:>13.6g}{:>13.6g}{:>12}{:>11}  {}{}\n", r.source, r.condition, r.quantity, r.recorded, r.ours,
                     percent(r.deviation), r.judged() ? percent(r.limit) : "-", r.met() ? "" : "MISSED ", r.note);
  return s;
}

}  // namespace rotorloop::propeller
