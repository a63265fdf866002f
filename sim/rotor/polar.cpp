// Reader of polar files and the plain interpolation that defines what a polar means.
#include "sim/rotor/polar.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/base/toml_file.hpp"

namespace rotorloop::sim {
namespace {
constexpr std::size_t kMinAngles = 37;                        // 10 degrees apart over the circle: fewer cannot hold a stall
constexpr Range kReynolds{1e3, 1e7, "1"};                     // from small insects to full-size rotors
constexpr Range kLift{-4.0, 4.0, "1"}, kDrag{0.0, 4.0, "1"};  // flat plate broadside: 2; slotted sections: 3.5
constexpr double kWrapTolerance = 1e-3;                       // -180 and 180 degrees are one direction

const char* const kFullCircle = "extend the table beyond stall, for example with rotorloop rotor polar (Viterna)";

void check_angles(const TomlTable& root, const std::vector<double>& alpha) {
  if (alpha.size() < kMinAngles)
    root.fail("alpha_deg", fmt::format("alpha_deg has {} angles, at least {} are needed", alpha.size(), kMinAngles),
              "only the attached branch is given", kFullCircle);
  for (std::size_t i = 1; i < alpha.size(); ++i)
    if (!(alpha[i] > alpha[i - 1]))
      root.fail("alpha_deg",
                fmt::format("alpha_deg[{}] = {} deg does not exceed its predecessor {} deg", i + 1, number_text(alpha[i]),
                            number_text(alpha[i - 1])),
                "two sweeps were joined unsorted", "sort the angles; give each once");
  if (alpha.front() != -180.0 || alpha.back() != 180.0)
    root.fail(
        "alpha_deg",
        fmt::format("alpha_deg runs from {} to {} deg, expected -180 to 180 deg", number_text(alpha.front()), number_text(alpha.back())),
        "only the attached branch is given; blades see every angle in reverse flow and when stopped", kFullCircle);
}

Polar polar_from(const TomlFile& file) {
  file.format({1});
  const TomlTable root = file.root();
  Polar polar;
  polar.source = root.text("source");
  polar.alpha_deg = root.numbers("alpha_deg", 0, {-180.0, 180.0, "deg"});
  check_angles(root, polar.alpha_deg);
  for (const TomlTable& t : root.tables("table", 1, 64)) {
    PolarTable table{t.number("reynolds", kReynolds), t.numbers("cl", polar.alpha_deg.size(), kLift),
                     t.numbers("cd", polar.alpha_deg.size(), kDrag)};
    if (!polar.tables.empty() && !(table.reynolds > polar.tables.back().reynolds))
      t.fail("reynolds",
             fmt::format("reynolds = {} does not exceed that of the table before, {}", number_text(table.reynolds),
                         number_text(polar.tables.back().reynolds)),
             "", "order the tables by rising Reynolds number; give each once");
    if (std::abs(table.cl.front() - table.cl.back()) > kWrapTolerance)
      t.fail("cl", fmt::format("cl is {} at -180 deg and {} at 180 deg", number_text(table.cl.front()), number_text(table.cl.back())),
             "the two ends are one direction of flow", "give both ends the same value");
    if (std::abs(table.cd.front() - table.cd.back()) > kWrapTolerance)
      t.fail("cd", fmt::format("cd is {} at -180 deg and {} at 180 deg", number_text(table.cd.front()), number_text(table.cd.back())),
             "the two ends are one direction of flow", "give both ends the same value");
    polar.tables.push_back(std::move(table));
  }
  file.refuse_unknown_keys();
  return polar;
}
}  // namespace

Polar read_polar(const std::filesystem::path& path) { return polar_from(TomlFile::read(path)); }
Polar parse_polar(std::string_view text, const std::filesystem::path& name_for_errors) {
  return polar_from(TomlFile::parse(text, name_for_errors));
}

SectionCoefficients polar_at(const Polar& polar, double alpha_deg, double reynolds) {
  const auto& a = polar.alpha_deg;
  const auto upper = std::upper_bound(a.begin() + 1, a.end() - 1, alpha_deg);
  const auto i = static_cast<std::size_t>(upper - a.begin());
  const double wa = std::clamp((alpha_deg - a[i - 1]) / (a[i] - a[i - 1]), 0.0, 1.0);
  const auto at = [&](const PolarTable& t) {
    return SectionCoefficients{t.cl[i - 1] + wa * (t.cl[i] - t.cl[i - 1]), t.cd[i - 1] + wa * (t.cd[i] - t.cd[i - 1])};
  };
  const auto& t = polar.tables;
  if (reynolds <= t.front().reynolds) return at(t.front());
  if (reynolds >= t.back().reynolds) return at(t.back());
  const auto above = std::upper_bound(t.begin(), t.end(), reynolds, [](double re, const PolarTable& table) { return re < table.reynolds; });
  const PolarTable &low = *(above - 1), &high = *above;
  const double wr = (reynolds - low.reynolds) / (high.reynolds - low.reynolds);
  const auto l = at(low), h = at(high);
  return {l.cl + wr * (h.cl - l.cl), l.cd + wr * (h.cd - l.cd)};
}

}  // namespace rotorloop::sim
