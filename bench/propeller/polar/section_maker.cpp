#include "bench/propeller/polar/section_maker.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "bench/propeller/fit/blade_files.hpp"
#include "bench/propeller/polar/polar_cache.hpp"
#include "host/base/error.hpp"

namespace rotorloop::propeller {
namespace fs = std::filesystem;
namespace {

const char* const kNoXfoil = "xfoil is not on PATH (apt install xfoil)";

// All that the numbers follow from.
std::string key_of(const SectionShape& s, const SweepSettings& o, const std::string& version) {
  std::string key = fmt::format("recipe {}, XFOIL {}, Ncrit {}, Re", kRecipeVersion, version, number_text(o.n_crit));
  for (const double re : o.reynolds) key += fmt::format(" {:.0f}", re);
  key += "\n" + s.label + "\n";
  for (std::size_t i = 0; i < s.x.size(); ++i) key += fmt::format("{:.6f} {:.6f}\n", s.x[i], s.y[i]);
  return key;
}

bool is_dat(const std::string& section) {
  std::string end = fs::path(section).extension().string();
  for (char& c : end) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
  return end == ".dat";
}

}  // namespace

bool SectionMaker::can_make(const std::string& section) const {
  std::error_code ec;
  const bool known = is_dat(section) ? fs::is_regular_file(section, ec)
                                     : naca_digits(section) || fs::is_regular_file(o_.shipped_polars / (section + ".dat"), ec);
  return known && XfoilProgram::on_path();
}

SectionShape SectionMaker::shape(const std::string& section) const {
  if (is_dat(section)) return read_section_file(TextFile::read(section));
  if (const auto digits = naca_digits(section)) return naca_section(*digits);
  std::error_code ec;
  const fs::path file = o_.shipped_polars / (section + ".dat");
  if (fs::is_regular_file(file, ec)) return read_section_file(TextFile::read(file));
  throw Error({"section " + section, fmt::format("neither NACA digits nor a .dat file, and there is no {}", file.generic_string()),
               "a misspelt name",
               "give four or five digits (4412, 23012), a file of coordinates as NAME.dat, or --polars with the folder of its polars"});
}

// The shipped section of the nearest thickness and camber, equally weighed.
SectionPolars SectionMaker::stand_in(const SectionShape& s) const {
  fs::path best;
  double least = std::numeric_limits<double>::infinity();
  std::error_code ec;
  for (const auto& f : fs::directory_iterator(o_.shipped_polars, ec)) {
    const std::string name = f.path().stem().string();
    if (f.path().extension() != ".toml" || !name.starts_with("naca") || !naca_digits(name)) continue;
    const SectionShape other = naca_section(*naca_digits(name));
    const double distance = std::hypot(other.thickness_percent - s.thickness_percent, other.camber_percent - s.camber_percent);
    if (distance < least || (distance == least && f.path() < best)) {
      least = distance;
      best = f.path();
    }
  }
  if (best.empty())
    throw Error({"section " + s.label,
                 fmt::format("{}, and {} has no polars of a NACA section", kNoXfoil, o_.shipped_polars.generic_string()), "",
                 "apt install xfoil, or name the folder of shipped polars with --polars"});
  const std::string name = best.stem().string();
  SectionPolars out{sim::read_polar(best), "stand_in", {}};
  const bool same = "NACA " + name.substr(4) == s.label;
  out.kind = same ? "shipped" : "stand_in";
  out.remarks.push_back(same ? fmt::format("{}: the shipped polars of {}", kNoXfoil, name)
                             : fmt::format("{}: polars of the shipped {} stand for {} ({} % thick with {} % camber for {} and {})",
                                           kNoXfoil, name, s.label, number_text(naca_section(name.substr(4)).thickness_percent),
                                           number_text(naca_section(name.substr(4)).camber_percent), number_text(s.thickness_percent),
                                           number_text(s.camber_percent)));
  return out;
}

SectionPolars SectionMaker::make(const std::string& section) const {
  const SectionShape s = shape(section);
  const auto xfoil = XfoilProgram::find();
  if (!xfoil) {
    if (!s.naca.empty()) return stand_in(s);
    throw Error({"section " + section,
                 fmt::format("{}: polars of coordinates cannot be made ({:.1f} % thick, {:.1f} % camber)", kNoXfoil, s.thickness_percent,
                             s.camber_percent),
                 "", "apt install xfoil, or give NACA digits of like thickness and camber, for which a shipped section stands in"});
  }
  const std::string key = key_of(s, o_.settings, xfoil->version());
  if (auto kept = cached_polar(o_.cache, key)) {
    SectionPolars out{std::move(*kept), "xfoil", {}};
    out.cached = true;
    return out;
  }
  SectionResult r = polars_of_sweeps(
      s.label, xfoil->version(), o_.settings, [&](const XfoilSweep& sweep) { return xfoil->sweep(s, sweep); }, o_.progress);
  // Through the text, so that kept polars and fresh ones are the same to the last digit. Cut by a time limit they depend on the machine's
  // load: not kept.
  const std::string text = polar_file_text(r.polar);
  if (!r.hung) keep_polar(o_.cache, key, text);
  return {sim::parse_polar(text, section), "xfoil", std::move(r.remarks)};
}

}  // namespace rotorloop::propeller
