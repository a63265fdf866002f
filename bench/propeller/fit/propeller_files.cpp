#include "bench/propeller/fit/propeller_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <sstream>

#include "host/base/error.hpp"

namespace rotorloop::propeller {
namespace {

namespace fs = std::filesystem;

enum class Kind { uiuc_geometry, mould, sections, spanwise, static_rows, sweep, predictions, stand_table, none };

bool begins(const TextLine& l, std::initializer_list<std::string_view> words) {
  return l.fields.size() >= words.size() && std::equal(words.begin(), words.end(), l.fields.begin());
}

Kind kind_of(const TextFile& f) {
  for (const TextLine& l : f.lines) {
    if (begins(l, {"r/R", "c/R", "beta"})) return Kind::uiuc_geometry;
    if (begins(l, {"STATION", "CHORD"})) return Kind::mould;
    if (begins(l, {"[rotor]"})) return Kind::sections;
    if (l.text.starts_with("property,file")) return Kind::spanwise;
    if (begins(l, {"RPM", "CT", "CP"})) return Kind::static_rows;
    if (begins(l, {"J", "CT", "CP"})) return Kind::sweep;
    if (l.text.find("PROP RPM") != std::string::npos) return Kind::predictions;
    if (l.text.starts_with("RPM;") && l.text.find("T(N)") != std::string::npos && l.text.find("Q(Nm)") != std::string::npos)
      return Kind::stand_table;
    if (l.number > 40) break;
  }
  return Kind::none;
}

// The last number of the name that can be a rotor speed: "apcsf_10x7_kt0828_3008.txt", "prop_J_4031rpm.txt".
double speed_in_name(const fs::path& name) {
  const std::string stem = name.stem().string();
  double found = 0.0;
  for (std::size_t i = 0; i < stem.size();) {
    if (!std::isdigit(static_cast<unsigned char>(stem[i]))) {
      ++i;
      continue;
    }
    std::size_t end = i;
    while (end < stem.size() && (std::isdigit(static_cast<unsigned char>(stem[end])) || stem[end] == '.')) ++end;
    const double v = std::atof(stem.substr(i, end - i).c_str());
    const bool alone = i == 0 || stem[i - 1] == '_' || stem[i - 1] == '-' || stem[i - 1] == ' ';
    if (alone && v >= 300.0 && v <= 1e5) found = v;
    i = end;
  }
  if (found == 0.0)
    throw Error({name.generic_string(), "a sweep of J does not say its rotor speed, and neither does the file's name",
                 "the file was renamed", "let the name end in the speed in RPM, as in sweep_4031rpm.txt"});
  return found;
}

std::vector<double> numbers_after(const std::string& line) {
  std::istringstream in(line.substr(line.find('=') + 1));
  std::vector<double> out;
  for (double v; in >> v;) out.push_back(v);
  return out;
}

// radius and chord in m, pitch in degrees: lists of one length.
PropellerGeometry read_sections(const TextFile& f, PropellerFiles& files) {
  std::map<std::string, std::vector<double>> of;
  for (const TextLine& l : f.lines)
    if (!l.fields.empty() && l.text.find('=') != std::string::npos) {
      std::string key = l.text.substr(0, l.text.find('='));
      key.erase(std::remove(key.begin(), key.end(), ' '), key.end());
      of[key] = numbers_after(l.text);
      if (key == "section")
        files.remarks.push_back(f.name.filename().generic_string() + " names the sections " + l.text.substr(l.text.find('=') + 1));
    }
  const auto one = [&](const std::string& key) {
    if (of[key].size() != 1)
      f.fail(1, fmt::format("{} is missing, or no single number", key), "",
             "give nblades, diameter, radius_hub, radius, chord and pitch under [rotor]");
    return of[key][0];
  };
  PropellerGeometry g;
  g.blades = static_cast<int>(one("nblades"));
  g.radius_m = 0.5 * one("diameter");
  g.hub_radius_m = one("radius_hub");
  const auto &r = of["radius"], &chord = of["chord"], &pitch = of["pitch"];
  if (r.size() < 5 || chord.size() != r.size() || pitch.size() != r.size())
    f.fail(1,
           fmt::format("{} radii, {} chords, {} pitch angles; expected as many of each, at least 5", r.size(), chord.size(), pitch.size()),
           "a list was cut off", "give the whole lists");
  for (std::size_t i = 0; i < r.size(); ++i) g.stations.push_back({r[i], chord[i], pitch[i], std::nullopt});
  // Element programs give the middles of elements: the last one is carried on to the tip.
  if (g.stations.back().r_m < 0.97 * g.radius_m) {
    const auto &a = g.stations[g.stations.size() - 2], &b = g.stations.back();
    const double share = (g.radius_m - b.r_m) / (b.r_m - a.r_m);
    g.stations.push_back({g.radius_m, std::max(0.3 * b.chord_m, b.chord_m + share * (b.chord_m - a.chord_m)),
                          b.twist_deg + share * (b.twist_deg - a.twist_deg), std::nullopt});
    files.remarks.push_back("chord and twist carried on from the last section to the tip");
  }
  if (of.contains("rho") && of["rho"].size() == 1) files.air_density_kg_m3 = of["rho"][0];
  return g;
}

struct Spanwise {
  std::vector<double> x, y;
  double at(double r) const {
    const auto i = std::clamp<std::size_t>(static_cast<std::size_t>(std::upper_bound(x.begin(), x.end(), r) - x.begin()), 1, x.size() - 1);
    return y[i - 1] + (y[i] - y[i - 1]) * (r - x[i - 1]) / (x[i] - x[i - 1]);
  }
};
Spanwise read_spanwise(const fs::path& path) {
  const TextFile f = TextFile::read(path);
  Spanwise d;
  for (std::size_t i = 1; i < f.lines.size(); ++i) {
    double x = 0.0, y = 0.0;
    if (std::sscanf(f.lines[i].text.c_str(), "%lf,%lf", &x, &y) == 2) {
      d.x.push_back(x);
      d.y.push_back(y);
    }
  }
  if (d.x.size() < 5) f.fail(1, "fewer than five rows r/R,value", "the file was cut off", "get the whole file");
  return d;
}

PropellerGeometry read_spanwise_tables(const TextFile& f, PropellerFiles& files) {
  PropellerGeometry g;
  for (const TextLine& l : f.lines) {
    double v = 0.0;
    if (std::sscanf(l.text.c_str(), "Rtip,%lf", &v) == 1) g.radius_m = v;
    if (std::sscanf(l.text.c_str(), "Rhub,%lf", &v) == 1) g.hub_radius_m = v;
    if (std::sscanf(l.text.c_str(), "B,%lf", &v) == 1) g.blades = static_cast<int>(v);
  }
  std::optional<Spanwise> chord, twist;
  for (const auto& e : fs::directory_iterator(f.name.parent_path())) {
    if (!e.is_regular_file()) continue;
    const TextFile beside = TextFile::read(e.path());
    if (beside.lines.front().text.starts_with("r/R,c/R")) chord = read_spanwise(e.path());
    if (beside.lines.front().text.starts_with("r/R,twist")) twist = read_spanwise(e.path());
  }
  if (!chord || !twist || !(g.radius_m > 0.0))
    f.fail(1, "Rtip, a table r/R,c/R or a table r/R,twist is missing beside it", "files are missing",
           "put all tables of the rotor into one folder");
  g.hub_radius_m = std::max(g.hub_radius_m, chord->x.front() * g.radius_m);
  for (int i = 0; i <= 24; ++i) {
    const double r = g.hub_radius_m / g.radius_m + (1.0 - g.hub_radius_m / g.radius_m) * i / 24.0;
    g.stations.push_back({r * g.radius_m, chord->at(r) * g.radius_m, twist->at(r), std::nullopt});
  }
  files.remarks.push_back("chord and twist by straight lines between the tables' rows, 25 stations");
  return g;
}

// Blocks "PROP RPM = n", then rows V J Pe Ct Cp …
void read_predictions(const TextFile& f, PropellerFiles& files) {
  double rpm = 0.0;
  for (const TextLine& l : f.lines) {
    if (l.text.find("PROP RPM") != std::string::npos) {
      rpm = l.fields.empty() ? 0.0 : std::atof(l.fields.back().c_str());
      files.sets.push_back({fmt::format("predicted by the maker, {:.0f} rpm", rpm), {}, false, false, true});
      continue;
    }
    if (rpm == 0.0 || l.fields.size() < 5 || l.fields[0].find_first_not_of("0123456789.-") != std::string::npos) continue;
    const double j = f.number(l, 1, "J", {0.0, 5.0, "1"}), ct = f.number(l, 3, "Ct", {-0.5, 1.0, "1"}),
                 cp = f.number(l, 4, "Cp", {-0.5, 1.0, "1"});
    files.sets.back().rows.push_back({rpm, j, ct, cp});
  }
}

MeasuredSet read_stand_table(const TextFile& f, double diameter_m, double rho) {
  MeasuredSet set{"static", {}, true, true};
  std::vector<std::string> names;
  std::size_t rpm = 0, thrust = 0, torque = 0;
  for (const TextLine& l : f.lines) {
    std::vector<std::string> cells;
    std::istringstream in(l.text);
    for (std::string c; std::getline(in, c, ';');) cells.push_back(c);
    if (cells.size() < 3) continue;
    if (names.empty()) {
      names = cells;
      for (std::size_t i = 0; i < cells.size(); ++i)
        cells[i] == "T(N)" ? thrust = i : cells[i] == "Q(Nm)" ? torque = i : cells[i] == "RPM" ? rpm = i : i;
      continue;
    }
    if (cells.size() <= std::max(thrust, torque))
      f.fail(l.number, "a row with fewer cells than the header", "the file was cut off", "get the whole file");
    const double n = std::atof(cells[rpm].c_str()) / 60.0, T = std::atof(cells[thrust].c_str()), Q = std::atof(cells[torque].c_str());
    if (!(n > 0.0)) f.fail(l.number, "RPM is not above 0", "", "leave rows at rest out");
    const double force = rho * n * n * std::pow(diameter_m, 4);
    set.rows.push_back({60.0 * n, 0.0, T / force, 2.0 * std::numbers::pi * Q / (force * diameter_m)});
  }
  return set;
}

std::vector<fs::path> all_files(const std::vector<fs::path>& paths) {
  std::vector<fs::path> out;
  for (const fs::path& p : paths) {
    std::error_code ec;
    if (!fs::is_directory(p, ec)) {
      out.push_back(p);
      continue;
    }
    std::vector<fs::path> in;
    for (const auto& e : fs::directory_iterator(p))
      if (e.is_regular_file() && e.path().extension() != ".md") in.push_back(e.path());
    std::sort(in.begin(), in.end());
    out.insert(out.end(), in.begin(), in.end());
  }
  return out;
}

// Static tables that follow each other in speed are one set. Those whose speeds overlap are repetitions or other specimens, which differ
// by some percent: the longest is fitted, the others are held out whole.
void add_static(PropellerFiles& files, MeasuredSet set, const std::string& file) {
  if (files.sets.empty() || files.sets.front().label != "static") {
    files.sets.insert(files.sets.begin(), std::move(set));
    files.static_file = file;
    return;
  }
  auto& rows = files.sets.front().rows;
  const auto slower = [](const MeasuredRow& a, const MeasuredRow& b) { return a.rpm < b.rpm; };
  const bool apart =
      !rows.empty() && !set.rows.empty() && (set.rows.front().rpm > rows.back().rpm || set.rows.back().rpm < rows.front().rpm);
  if (apart) {
    rows.insert(rows.end(), set.rows.begin(), set.rows.end());
    std::sort(rows.begin(), rows.end(), slower);
    return;
  }
  std::string other = file;
  if (set.rows.size() > rows.size()) {
    std::swap(set, files.sets.front());
    std::swap(other, files.static_file);
  }
  files.remarks.push_back(
      fmt::format("{} overlaps {} in speed, another run or specimen: kept apart, not fitted", other, files.static_file));
  set.label = "static, " + other;
  files.sets.push_back(std::move(set));
}

// Sweeps of one speed are distinguished by their files.
void add_sweep(PropellerFiles& files, MeasuredSet set, const std::string& file) {
  if (std::any_of(files.sets.begin(), files.sets.end(), [&](const MeasuredSet& s) { return s.label == set.label; }))
    set.label += ", " + file;
  files.sets.push_back(std::move(set));
}

}  // namespace

PropellerFiles read_propeller_files(const std::vector<fs::path>& paths, const PropellerFileOptions& o) {
  PropellerFiles files;
  files.air_density_kg_m3 = o.air_density_kg_m3;
  std::vector<std::pair<TextFile, Kind>> tables;
  for (const fs::path& p : all_files(paths)) {
    TextFile f = TextFile::read(p);
    const Kind kind = kind_of(f);
    if (kind == Kind::mould) files.geometries.insert(files.geometries.begin(), {"mould", read_apc_mould(f)});
    if (kind == Kind::sections) files.geometries.push_back({"sections", read_sections(f, files)});
    if (kind == Kind::spanwise) files.geometries.push_back({"sections", read_spanwise_tables(f, files)});
    if (kind == Kind::none) files.remarks.push_back(p.filename().generic_string() + " is no file that is known: left out");
    tables.emplace_back(std::move(f), kind);
  }
  files.diameter_m = o.diameter_m.value_or(files.geometries.empty() ? 0.0 : 2.0 * files.geometries.front().geometry.radius_m);
  for (const auto& [f, kind] : tables) {
    if (kind == Kind::uiuc_geometry) {
      if (files.diameter_m == 0.0)
        throw Error({"--diameter", fmt::format("is missing: {} gives radii as shares of the tip's", f.name.generic_string()), "",
                     "give the propeller's diameter in m"});
      files.geometries.push_back({"photo", read_uiuc_geometry(f, 0.5 * files.diameter_m, o.blades)});
    }
    const std::string name = f.name.filename().generic_string();
    if (kind == Kind::static_rows) add_static(files, {"static", read_uiuc_static(f), true, true}, name);
    if (kind == Kind::stand_table) add_static(files, read_stand_table(f, files.diameter_m, files.air_density_kg_m3), name);
    if (kind == Kind::predictions) read_predictions(f, files);
    if (kind == Kind::sweep) {
      const double rpm = speed_in_name(f.name.filename());
      add_sweep(files, {fmt::format("J {:.0f} rpm", rpm), read_uiuc_sweep(f, rpm), false, true}, name);
    }
  }
  if (files.geometries.empty())
    throw Error({"GEOMETRY", "none of the files holds a geometry", "tables alone do not say the blade's shape",
                 "give a UIUC geometry, an APC PE0 file or sections"});
  return files;
}

}  // namespace rotorloop::propeller
