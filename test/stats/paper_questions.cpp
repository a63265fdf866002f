// Which effects, alone and in mixes of two and three, would bias a fit of eq. (1)-(8) as the paper's Table I is biased against CAD and
// stand? One sweep over three identification flights gives, for every effect of host/effects, the shift of each fitted parameter when the
// effect is there and the model lacks it: S_θθ⁻¹ S_θγ γ. Mixes are then searched within physical bounds. Linear in γ: sizes that move a
// parameter by tens of per cent are to be confirmed by a refit (docs/acceptance/paper_questions.md).
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "bench/sysid/diagnose/screening.hpp"
#include "bench/sysid/log/check/checks.hpp"
#include "bench/sysid/log/read_flight.hpp"
#include "host/base/error.hpp"
#include "host/vehicle/effect_catalogue.hpp"
#include "host/vehicle/vehicle_file.hpp"

namespace rotorloop::test {
namespace {

constexpr int kTargets = 5;
using Shift = Eigen::Matrix<double, kTargets, 1>;
// Table I, estimate over CAD or stand, less 1; and the static thrust coefficient of flight over that of the stand, which is 8 % higher.
const char* const kNames[kTargets] = {"I_xx", "I_yy", "I_zz", "c_q", "static c_t"};
const Shift kPaper{0.270, 0.292, -0.155, 0.160, 1.0 / 1.08 - 1.0};
// Standard uncertainty of each: Table I's standard deviation over the truth; for c_t 3 %, of stand and flight together.
const Shift kPaperU{0.071, 0.067, 0.059, 0.167, 0.03};
constexpr double kChi2Limit = 11.07;  // 95 % of five figures

struct Unit {
  std::string name;  // "rotor_inertia_reaction.inertia_kg_m2"
  std::string unit;
  Shift per_scale;                            // shift by one `scale`
  double scale = 1.0, low = 0.0, high = 0.0;  // of the effect above its neutral value, SI
};
struct Mix {
  std::vector<std::size_t> of;
  Eigen::VectorXd size;  // in scales
  double chi2 = 0.0;
  Shift total = Shift::Zero();
};

// The least chi² within bounds: coordinate by coordinate, which for a convex quadratic over a box ends at its minimum.
Mix best_sizes(const std::vector<Unit>& units, std::vector<std::size_t> of) {
  Mix m;
  m.of = std::move(of);
  m.size = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(m.of.size()));
  for (int round = 0; round < 60; ++round) {
    for (std::size_t k = 0; k < m.of.size(); ++k) {
      const Unit& u = units[m.of[k]];
      const auto at = static_cast<Eigen::Index>(k);
      const Shift own = u.per_scale.cwiseQuotient(kPaperU);
      const Shift rest = (kPaper - m.total + u.per_scale * m.size(at)).cwiseQuotient(kPaperU);
      const double to = std::clamp(own.squaredNorm() > 0.0 ? own.dot(rest) / own.squaredNorm() : 0.0, u.low / u.scale, u.high / u.scale);
      m.total += u.per_scale * (to - m.size(at));
      m.size(at) = to;
    }
  }
  m.chi2 = (kPaper - m.total).cwiseQuotient(kPaperU).squaredNorm();
  return m;
}

std::string row(const Mix& m, const std::vector<Unit>& units) {
  std::string s;
  for (std::size_t k = 0; k < m.of.size(); ++k) {
    const Unit& u = units[m.of[k]];
    const double size = m.size(static_cast<Eigen::Index>(k)) * u.scale;
    const bool at_bound = size <= u.low * (1 - 1e-9) || size >= u.high * (1 - 1e-9);
    s += fmt::format("{}`{}` {:+.3g} {}{}", k ? ", " : "", u.name, size, u.unit, at_bound && size != 0.0 ? " (bound)" : "");
  }
  s = fmt::format("| {} | {:.1f} |", s, m.chi2);
  for (int i = 0; i < kTargets; ++i) s += fmt::format(" {:+.0f} |", 100.0 * m.total(i));
  return s + "\n";
}

std::string table(const char* title, std::vector<Mix>& mixes, const std::vector<Unit>& units, std::size_t most) {
  std::stable_sort(mixes.begin(), mixes.end(), [](const Mix& a, const Mix& b) { return a.chi2 < b.chi2; });
  std::string s = fmt::format(
      "\n### {}\n\n| effect, size | chi² of 5 | I_xx % | I_yy % | I_zz % | c_q % | c_t % |\n| --- | --- | --- | --- | --- | --- | --- |\n",
      title);
  s += "| paper | 0 |";
  for (int i = 0; i < kTargets; ++i) s += fmt::format(" {:+.0f} ± {:.0f} |", 100.0 * kPaper(i), 100.0 * kPaperU(i));
  s += "\n";
  for (std::size_t k = 0; k < std::min(most, mixes.size()); ++k) s += row(mixes[k], units);
  return s;
}

// How large an effect may be on the paper's vehicle without having been seen in hover: bounds of the library are those of any vehicle.
double largest(const std::string& id, const diagnose::CandidateParameter& p) {
  if (id == "products_of_inertia") return 3e-4;  // kg m²: a tenth of I_xx and I_yy; a symmetric frame has less
  if (id == "weak_rotor" || id == "rotor_speed_scale" || id == "rotor_torque_scale") return 0.1;
  if (id == "rotor_inertia_reaction" || id == "gyroscopic") return 15e-6;  // kg m²: 5-inch propeller and bell are 5 to 10e-6
  if (id == "pose_delay" || id == "rotor_speed_delay" || id == "thrust_lag") return 0.03;
  return 4.0 * p.scale;
}

double hover_c_t(const estimate::ModelValues& v) {
  const double omega = 945.0, k1 = v[estimate::kK1], k2 = v[estimate::kK2],
               momentum = 2.0 * v.geometry.air_density_kg_m3 * std::numbers::pi * v.geometry.radius_m * v.geometry.radius_m;
  // T = k1 ω² + k2 ω v_i, T = momentum v_i²: the positive root.
  const double b = -k2 * omega / momentum, c = -k1 * omega * omega / momentum;
  const double v_i = 0.5 * (-b + std::sqrt(b * b - 4.0 * c));
  return momentum * v_i * v_i / (omega * omega);
}

Shift shifts_of(const identify::Identification& r, const Eigen::VectorXd& change) {
  estimate::ModelValues v = r.fit.values.front();
  const estimate::ModelValues before = v;
  for (std::size_t i = 0; i < r.fit.estimates.size(); ++i)
    if (r.fit.estimates[i].flight < 0) v[r.fit.estimates[i].parameter] += change(static_cast<Eigen::Index>(i));
  return {v[estimate::kIxx] / before[estimate::kIxx] - 1.0, v[estimate::kIyy] / before[estimate::kIyy] - 1.0,
          v[estimate::kIzz] / before[estimate::kIzz] - 1.0, v[estimate::kCq] / before[estimate::kCq] - 1.0,
          hover_c_t(v) / hover_c_t(before) - 1.0};
}

int run(const std::string& vehicle_path, const std::vector<std::string>& flights) {
  const host::VehicleFile vehicle = host::read_vehicle(vehicle_path, host::builtin_effect_catalogue());
  std::vector<identify::FlightToFit> to_fit;
  for (const auto& path : flights) {
    const log::CheckedFlight checked = log::check_flight(log::read_flight(path, nullptr), host::to_model(vehicle));
    checked.throw_if_refused();
    to_fit.push_back({checked.flight, identify::FlightRole::any, checked.segments, {}});
  }
  identify::IdentifyOptions o;
  o.grid.rate_Hz = 100.0;
  o.wishes.hold = {"pose_delay", "rotor_delay"};  // the paper estimates no delays
  o.fit.noise.rounds = 12;
  o.fit.noise.per_flight = true;
  o.fit.threads = 2;
  const identify::Identification r = identify::identify(to_fit, vehicle, o, [](const identify::IdentifyProgress& p) {
    std::fprintf(stderr, "%s %d: %g\n", p.part.c_str(), p.fit.iteration, p.fit.cost);
  });
  const diagnose::Screening s = diagnose::screen(r, {}, {}, 1.0, 2);
  const Eigen::Index base = s.table.base;
  const Eigen::LDLT<Eigen::MatrixXd> model(s.table.information.topLeftCorner(base, base));

  std::vector<Unit> units;
  for (const diagnose::Candidate& c : s.candidates) {
    for (std::size_t k = 0; k < c.parameters.size(); ++k) {
      const diagnose::CandidateParameter& p = c.parameters[k];
      const Eigen::VectorXd change = model.solve(s.table.information.col(c.columns[k]).head(base)) * p.scale;
      if (!(change.norm() > 0.0) || !change.allFinite()) continue;
      const double most = largest(c.id, p);
      units.push_back({c.id + (c.parameters.size() > 1 ? "." + p.name : ""), p.unit, shifts_of(r, change * 1e-3) * 1e3, p.scale,
                       std::max(p.min - p.neutral, -most), std::min(p.max - p.neutral, most)});
    }
  }
  // What no flight determines, as everything scales with it: a wrong mass moves all wrench coefficients; wrong arms the torque of roll and
  // pitch, with it all three inertias (Euler's equations are homogeneous, and I_zz is determined by its part in them) and by I_zz c_q.
  units.push_back({"mass assumed too large", "1", Shift{1, 1, 1, 1, 1} * 0.01, 0.01, -0.05, 0.05});
  units.push_back({"arms assumed too long", "1", Shift{1, 1, 1, 1, 0} * 0.01, 0.01, -0.05, 0.05});

  std::printf("Baseline: I %.3e %.3e %.3e kg m², c_q %.3e N m s², static c_t %.3e N s²\n", r.fit.values[0][estimate::kIxx],
              r.fit.values[0][estimate::kIyy], r.fit.values[0][estimate::kIzz], r.fit.values[0][estimate::kCq], hover_c_t(r.fit.values[0]));
  std::vector<Mix> one, two, three;
  for (std::size_t a = 0; a < units.size(); ++a) one.push_back(best_sizes(units, {a}));
  std::printf("%s", table("Alone, at the size within bounds that fits best", one, units, 15).c_str());
  for (std::size_t a = 0; a < units.size(); ++a)
    for (std::size_t b = a + 1; b < units.size(); ++b) two.push_back(best_sizes(units, {a, b}));
  std::printf("%s", table("Two", two, units, 12).c_str());
  for (std::size_t a = 0; a < units.size(); ++a)
    for (std::size_t b = a + 1; b < units.size(); ++b)
      for (std::size_t c = b + 1; c < units.size(); ++c) {
        Mix m = best_sizes(units, {a, b, c});
        if (m.chi2 < 3.0 * kChi2Limit) three.push_back(std::move(m));
      }
  std::printf("%s", table("Three", three, units, 15).c_str());
  const auto fits = [](const std::vector<Mix>& v) {
    return std::count_if(v.begin(), v.end(), [](const Mix& m) { return m.chi2 < kChi2Limit; });
  };
  std::printf("\n%zu sizes of effects; within 95 %% of the paper's figures: %td alone, %td of %zu pairs, %td triples.\n", units.size(),
              fits(one), fits(two), two.size(), fits(three));
  std::printf("\n### Shift by one typical size, %%\n\n| effect | size |");
  for (const auto* n : kNames) std::printf(" %s |", n);
  std::printf("\n| --- | --- | --- | --- | --- | --- | --- |\n");
  for (const auto& u : units) {
    if (u.per_scale.cwiseAbs().maxCoeff() < 0.001) continue;
    std::printf("| `%s` | %.3g %s |", u.name.c_str(), u.scale, u.unit.c_str());
    for (int i = 0; i < kTargets; ++i) std::printf(" %+.1f |", 100.0 * u.per_scale(i));
    std::printf("\n");
  }
  return 0;
}

}  // namespace
}  // namespace rotorloop::test

int main(int argc, char** argv) {
  CLI::App app{"biases of the paper's Table I: which effects would make them"};
  std::string vehicle;
  std::vector<std::string> flights;
  app.add_option("--vehicle", vehicle)->required();
  app.add_option("--flight", flights)->required();
  CLI11_PARSE(app, argc, argv);
  try {
    return rotorloop::test::run(vehicle, flights);
  } catch (const rotorloop::Error& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return to_int(e.exit_code());
  }
}
