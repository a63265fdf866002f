#include "bench/propeller/catalogue.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/propeller/section_blade.hpp"
#include "host/base/error.hpp"

namespace rotorloop::propeller {
namespace {
constexpr double kInch_m = 0.0254;

const char* const kUnpublished = "section not published, about 10 % thick; the one that the shipped blade flies with (decision 0023)";

CataloguedPropeller apc_4_2x4() {
  return {.key = "apc_4.2x4",
          .title = "APC 4.2x4",
          .diameter_m = 4.2 * kInch_m,
          .blades = 2,
          .mould = "42x4-PERF.PE0",
          .uiuc_geometry = "apcff_4.2x4_geom.txt",
          .static_rows = "apcff_4.2x4_static_0615rd.txt",
          .sweeps = {{"apcff_4.2x4_0620rd_10042.txt", 10042}, {"apcff_4.2x4_0621rd_10071.txt", 10071}},
          .judged = true,
          .section = {.inner = "naca4412",
                      .outer = "",
                      .reason = "the mould file names CLARK-Y scaled to a thickness of 14.7 % at 0.75 R, which scales its camber to 4.3 %: "
                                "nearer to NACA 4412 than to the plain Clark-Y of the polars"}};
}

CataloguedPropeller apc_10x7sf() {
  return {.key = "apc_10x7sf",
          .title = "APC 10x7 SF",
          .diameter_m = 10 * kInch_m,
          .blades = 2,
          .mould = "10x7SF-PERF.PE0",
          .uiuc_geometry = "apcsf_10x7_geom.txt",
          .static_rows = "apcsf_10x7_static_kt0827.txt",
          .sweeps = {{"apcsf_10x7_kt0828_3008.txt", 3008},
                     {"apcsf_10x7_kt0830_3999.txt", 3999},
                     {"apcsf_10x7_kt0829_4011.txt", 4011},
                     {"apcsf_10x7_kt0831_5003.txt", 5003},
                     {"apcsf_10x7_kt0832_5006.txt", 5006},
                     {"apcsf_10x7_kt0833_6006.txt", 6006},
                     {"apcsf_10x7_kt0834_6014.txt", 6014}},
          .judged = true,
          .section = {.inner = "naca4412",
                      .outer = "",
                      .reason = "the mould file names E63 at 4.5 % thickness, but XFOIL's polars of E63 have holes of 4 degrees where lift "
                                "vanishes; NACA 4412 is APC's own outer section"}};
}

CataloguedPropeller da4002_5x3_75() {
  return {.key = "da4002_5x3.75",
          .title = "DA4002 5x3.75",
          .diameter_m = 5 * kInch_m,
          .blades = 2,
          .mould = "",
          .uiuc_geometry = "da4002_5x3.75_geom.txt",
          .static_rows = "da4002_5x3.75_static.txt",
          .sweeps = {{"da4002_5x3.75_J_4031rpm.txt", 4031}, {"da4002_5x3.75_J_5039rpm.txt", 5039}, {"da4002_5x3.75_J_6045rpm.txt", 6045}},
          .judged = true,
          .section = {.inner = "naca4410", .outer = "", .reason = kUnpublished}};
}

CataloguedPropeller da4002_9x6_75() {
  return {.key = "da4002_9x6.75",
          .title = "DA4002 9x6.75",
          .diameter_m = 9 * kInch_m,
          .blades = 2,
          .mould = "",
          .uiuc_geometry = "da4002_9x6.75_geom.txt",
          .static_rows = "da4002_9x6.75_static.txt",
          .sweeps = {{"da4002_9x6.75_J_2013rpm.txt", 2013, false},
                     {"da4002_9x6.75_J_3030rpm.txt", 3030},
                     {"da4002_9x6.75_J_4049rpm.txt", 4049},
                     {"da4002_9x6.75_J_4054rpm.txt", 4054},
                     {"da4002_9x6.75_J_5028rpm.txt", 5028},
                     {"da4002_9x6.75_J_5064rpm.txt", 5064}},
          .judged = true,
          .section = {.inner = "naca4410", .outer = "", .reason = kUnpublished}};
}

CataloguedPropeller apc_16x8e() {
  return {.key = "apc_16x8e",
          .title = "APC 16x8 E",
          .diameter_m = 16 * kInch_m,
          .blades = 2,
          .mould = "16x8E-PERF.PE0",
          .uiuc_geometry = "",
          .static_rows = "apce_16x8_static_2150od.txt",
          .sweeps = {{"apce_16x8_2154od_4968.txt", 4968}, {"apce_16x8_2155od_5027.txt", 5027}},
          .judged = false,
          .section = {.inner = "eppler_e63",
                      .outer = "naca4412",
                      .blend_from = 1.40 / 8.0,
                      .blend_to = 5.12 / 8.0,
                      .reason = "the mould file: E63 at 1.40 in runs into APC12 at 5.12 in, which it calls equivalent to NACA 4412"}};
}

std::vector<CataloguedPropeller> make() { return {apc_4_2x4(), apc_10x7sf(), da4002_5x3_75(), da4002_9x6_75(), apc_16x8e()}; }

[[noreturn]] void lacking(const std::filesystem::path& path) {
  throw Error({path.generic_string(), "not found", "the data folder is incomplete, or ROTORLOOP_DATA names another one",
               "get the folder propellers again, or correct ROTORLOOP_DATA"},
              ExitCode::data_quality);
}

TextFile read_data(const std::filesystem::path& path) {
  std::error_code ec;
  if (!std::filesystem::is_regular_file(path, ec)) lacking(path);
  return TextFile::read(path);
}

}  // namespace

const std::vector<CataloguedPropeller>& propeller_catalogue() {
  static const std::vector<CataloguedPropeller> catalogue = make();
  return catalogue;
}

std::size_t sweep_to_fit(const std::vector<MeasuredSet>& sets, double fit_rpm) {
  std::vector<std::size_t> sweeps;
  for (std::size_t i = 1; i < sets.size(); ++i)
    if (!sets[i].predicted && std::any_of(sets[i].rows.begin(), sets[i].rows.end(), [](const MeasuredRow& r) { return r.j > 0.0; }))
      sweeps.push_back(i);
  double wanted_rpm = fit_rpm;
  if (fit_rpm <= 0.0)
    for (const std::size_t i : sweeps) wanted_rpm += sets[i].rows.front().rpm / static_cast<double>(sweeps.size());
  std::size_t best = 0;
  double nearest = std::numeric_limits<double>::infinity();
  for (const std::size_t i : sweeps) {
    const auto& rows = sets[i].rows;
    const double away = std::fabs(rows.front().rpm - wanted_rpm);
    const bool to_zero = std::any_of(rows.begin(), rows.end(), [](const MeasuredRow& r) { return r.ct < kLeastThrust; });
    if (away < nearest && (fit_rpm > 0.0 || to_zero)) {
      nearest = away;
      best = i;
    }
  }
  return best;
}

MeasuredPropeller read_measured_propeller(const PropellerInputs& inputs, const CataloguedPropeller& entry) {
  const auto folder = inputs.data / "propellers" / entry.key;
  std::error_code ec;
  if (!std::filesystem::is_directory(folder, ec)) lacking(folder);
  MeasuredPropeller p{entry, {}, {}};
  if (!inputs.section.empty()) p.entry.section = {.inner = inputs.section, .outer = "", .reason = "asked for"};
  p.sets.push_back({"static", read_uiuc_static(read_data(folder / entry.static_rows)), true, entry.judged});
  for (const SweepFile& s : entry.sweeps)
    p.sets.push_back(
        {fmt::format("J {:.0f} rpm", s.rpm), read_uiuc_sweep(read_data(folder / s.file), s.rpm), false, entry.judged && s.judged});
  p.sets[sweep_to_fit(p.sets, inputs.fit_rpm)].fitted = true;
  const auto add = [&](const char* source, const PropellerGeometry& g) {
    p.geometries.push_back({source, to_blade(inputs, g, p.entry.section, largest_reynolds(g, p.sets, entry.diameter_m))});
  };
  if (!entry.mould.empty()) add("mould", read_apc_mould(read_data(folder / entry.mould)));
  if (!entry.uiuc_geometry.empty())
    add("photo", read_uiuc_geometry(read_data(folder / entry.uiuc_geometry), 0.5 * entry.diameter_m, entry.blades));
  return p;
}

}  // namespace rotorloop::propeller
