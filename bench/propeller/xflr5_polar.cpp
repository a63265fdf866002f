#include "bench/propeller/xflr5_polar.hpp"

#include <fmt/format.h>

#include <array>

namespace rotorloop::propeller {
namespace {
constexpr std::string_view kAirfoil = "Calculated polar for:";
constexpr std::array<std::string_view, 12> kPolarColumns{"alpha", "CL",  "CD",  "CDp",   "Cm",     "Top",
                                                         "Xtr",   "Bot", "Xtr", "Cpmin", "Chinge", "XCp"};
// XFLR5 writes two values under Chinge, so that a row of 10 names has 12 numbers; older exports stop at Bot Xtr.
constexpr std::size_t kFewestFields = 7, kMostFields = 12;
constexpr std::size_t kMinPolarRows = 10;
constexpr double kCoversFrom_deg = 0.0, kCoversTo_deg = 8.0;  // a propeller works there

// The number after `key` and "=", as in " Mach =   0.000     Re =     0.030 e 6     Ncrit =   7.000".
double after(const TextFile& file, const TextLine& line, std::string_view key, Range range, double scale = 1.0) {
  for (std::size_t i = 0; i + 2 < line.fields.size(); ++i)
    if (line.fields[i] == key && line.fields[i + 1] == "=") return scale * file.number(line, i + 2, key, range);
  file.fail(line.number, fmt::format("\"{} =\" is missing", key), "another kind of polar", "export the polar from XFLR5 as text");
}
}  // namespace

SectionPolar read_xflr5_polar(const TextFile& file) {
  SectionPolar p;
  auto line = file.lines.begin();
  const auto end_of_file = static_cast<int>(file.lines.size());
  for (; line != file.lines.end() && (line->fields.empty() || line->fields[0] != "alpha"); ++line) {
    if (const auto at = line->text.find(kAirfoil); at != std::string::npos) {
      const std::string name = line->text.substr(at + kAirfoil.size());
      p.airfoil = name.substr(std::min(name.find_first_not_of(' '), name.size()));
    }
    if (line->text.find("Re =") == std::string::npos) continue;
    if (line->text.find(" e 6") == std::string::npos)
      file.fail(line->number, "Re is not given in millions (\"e 6\")", "another program's polar", "export the polar from XFLR5 as text");
    p.reynolds = after(file, *line, "Re", {1e-3, 10.0, "million"}, 1e6);
    p.n_crit = after(file, *line, "Ncrit", {0.0, 15.0, "1"});
  }
  if (line == file.lines.end())
    file.fail(end_of_file, "no table: no line that begins with alpha", "not a polar, or cut off", "export the polar from XFLR5 as text");
  if (p.airfoil.empty())
    file.fail(line->number, "no line \"Calculated polar for: NAME\" above the table", "an edited header", "export it again");
  if (p.reynolds <= 0.0)
    file.fail(line->number, "no line \"Mach = … Re = … Ncrit = …\" above the table", "an edited header", "export it again");
  const auto& names = line->fields;
  if (names.size() > kPolarColumns.size() || names.size() < 3 || !std::equal(names.begin(), names.end(), kPolarColumns.begin()))
    file.fail(line->number, fmt::format("unknown columns \"{}\"", line->text), "columns added, or another program's polar",
              "export the polar from XFLR5 as text, all columns");
  if (++line != file.lines.end() && line->text.find("---") != std::string::npos) ++line;
  for (; line != file.lines.end(); ++line) {
    if (line->fields.empty()) continue;
    const std::size_t n = line->fields.size();
    if (n < kFewestFields || n > kMostFields)
      file.fail(line->number, fmt::format("{} fields, expected {} to {}", n, kFewestFields, kMostFields), "the file was cut off",
                "export the polar again");
    for (std::size_t i = 3; i < n; ++i) file.number(*line, i, fmt::format("field {}", i + 1), {-1e6, 1e6, "1"});
    const double alpha = file.number(*line, 0, "alpha", {-180.0, 180.0, "deg"});
    if (!p.alpha_deg.empty() && !(alpha > p.alpha_deg.back()))
      file.fail(
          line->number,
          fmt::format("alpha = {} deg does not exceed that of the row before, {} deg", number_text(alpha), number_text(p.alpha_deg.back())),
          "", "order the rows by angle; give each once");
    p.alpha_deg.push_back(alpha);
    p.cl.push_back(file.number(*line, 1, "CL", {-4.0, 4.0, "1"}));
    p.cd.push_back(file.number(*line, 2, "CD", {1e-4, 2.0, "1"}));
  }
  if (p.alpha_deg.size() < kMinPolarRows)
    file.fail(end_of_file, fmt::format("{} rows, expected at least {}", p.alpha_deg.size(), kMinPolarRows),
              "the file was cut off, or XFOIL hardly converged", "compute the polar with smaller steps");
  if (p.alpha_deg.front() > kCoversFrom_deg || p.alpha_deg.back() < kCoversTo_deg)
    file.fail(end_of_file,
              fmt::format("the polar covers {} to {} deg, expected at least {} to {}", number_text(p.alpha_deg.front()),
                          number_text(p.alpha_deg.back()), number_text(kCoversFrom_deg), number_text(kCoversTo_deg)),
              "the file was cut off, or XFOIL hardly converged", "compute the polar again");
  return p;
}

}  // namespace rotorloop::propeller
