#include "bench/propeller/measured.hpp"

#include <fmt/format.h>

#include <cmath>

namespace rotorloop::propeller {
namespace {
constexpr std::size_t kMinMeasuredRows = 4;  // fewer cannot be split into fitted and held-out rows
constexpr Range kThrust{-0.5, 1.0, "1"};     // C_T of propellers: -0.2 (windmill) to 0.3
constexpr Range kPower{-0.5, 1.0, "1"};
constexpr double kEfficiencyDigits = 5e-4;  // J CT - eta CP; vol. 1 rounds all four to 3 or 4 decimals
}  // namespace

std::vector<MeasuredRow> read_uiuc_static(const TextFile& file) {
  std::vector<MeasuredRow> rows;
  for (const TableRow& r : read_table(file, {{"RPM", {100.0, 1e5, "rev/min"}}, {"CT", kThrust}, {"CP", kPower}}, kMinMeasuredRows)) {
    if (!rows.empty() && !(r.values[0] > rows.back().rpm))
      file.fail(r.line,
                fmt::format("RPM = {} does not exceed that of the row before, {}", number_text(r.values[0]), number_text(rows.back().rpm)),
                "", "order the rows by rotor speed; give each once");
    rows.push_back({r.values[0], 0.0, r.values[1], r.values[2]});
  }
  return rows;
}

std::vector<MeasuredRow> read_uiuc_sweep(const TextFile& file, double rpm) {
  std::vector<MeasuredRow> rows;
  for (const TableRow& r :
       read_table(file, {{"J", {0.0, 5.0, "1"}}, {"CT", kThrust}, {"CP", kPower}, {"eta", {-1e3, 1e3, "1"}}}, kMinMeasuredRows)) {
    const double j = r.values[0], ct = r.values[1], cp = r.values[2], eta = r.values[3];
    if (std::fabs(j * ct - eta * cp) > kEfficiencyDigits)
      file.fail(r.line, fmt::format("eta = {} is not J CT / CP = {}", number_text(eta), number_text(j * ct / cp)),
                "swapped or edited columns", "give J, CT, CP and eta of one measurement");
    rows.push_back({rpm, j, ct, cp});
  }
  return rows;
}

}  // namespace rotorloop::propeller
