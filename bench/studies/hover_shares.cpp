#include "bench/studies/hover_shares.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "host/base/error.hpp"
#include "host/base/statistics.hpp"
#include "host/base/symmetric_matrix.hpp"
#include "host/vehicle/effect_catalogue.hpp"

namespace rotorloop::studies {
namespace {

using host::effect;

using Vector4 = Eigen::Vector4d;

constexpr double kLevel_m_s = 0.15;
constexpr std::size_t kLeastHoverSamples = 200;
constexpr double kFull = 0.9999;
// Thrust goes with motor voltage to this power near hover: the map from thrust to voltage of Crazyflie firmware, -0.0006239 t² + 0.088 t
// with t the thrust of all four in gf, has the slope 0.63 in logarithms at 38 gf.
constexpr double kThrustPerVoltage = 1.58;
constexpr double kLeastScatter = 0.003;  // of a hover's mean demand: three flights may agree by chance
constexpr double kBeyond = 3.3;          // u: a change
constexpr double kSway = 5.0;            // times the reference's: something swings
constexpr double kSwayLow_Hz = 0.2, kSwayHigh_Hz = 0.8, kSwayStep_Hz = 0.05;
constexpr double kSaturatedHover = 0.05;
constexpr double kLeastLoss = 0.0, kMostLoss = 0.5;

double interpolated(const log::Stream<double>& s, double t_s) {
  const auto it = std::upper_bound(s.t_s.begin(), s.t_s.end(), t_s);
  return s.value[it == s.t_s.begin() ? 0 : static_cast<std::size_t>(it - s.t_s.begin()) - 1];
}

struct Heights {
  std::vector<double> t_s, z_m, climb_m_s;
};
Heights heights(const log::FlightRecord& f) {
  Heights h;
  const bool pose = !f.pose.empty();
  const std::size_t n = pose ? f.pose.size() : f.position_W_m.size();
  for (std::size_t i = 0; i < n; ++i) {
    h.t_s.push_back(pose ? f.pose.t_s[i] : f.position_W_m.t_s[i]);
    h.z_m.push_back(pose ? f.pose.value[i].p_W_m.z() : f.position_W_m.value[i].z());
  }
  h.climb_m_s.assign(n, 0.0);
  for (std::size_t i = 10; i + 10 < n; ++i) h.climb_m_s[i] = (h.z_m[i + 10] - h.z_m[i - 10]) / (h.t_s[i + 10] - h.t_s[i - 10]);
  return h;
}

// rms of yaw in the band, by Hann-windowed Fourier sums over each stretch of hover of at least 3 s.
double yaw_sway(const log::FlightRecord& f, const std::vector<double>& t_s) {
  const auto yaw = f.extra.find("yaw[rad]");
  if (yaw == f.extra.end() || yaw->second.empty()) return 0.0;
  double power = 0.0, length = 0.0;
  for (std::size_t a = 0; a < t_s.size();) {
    std::size_t b = a + 1;
    while (b < t_s.size() && t_s[b] - t_s[b - 1] < 0.5) ++b;
    const double n = static_cast<double>(b - a), span = t_s[b - 1] - t_s[a];
    if (span >= 3.0) {
      std::vector<double> y;
      for (std::size_t i = a; i < b; ++i) y.push_back(interpolated(yaw->second, t_s[i]));
      double mean = 0.0, slope = 0.0, squares = 0.0;
      for (const double v : y) mean += v / n;
      for (std::size_t i = a; i < b; ++i) {
        const double x = t_s[i] - 0.5 * (t_s[a] + t_s[b - 1]);
        slope += x * (y[i - a] - mean), squares += x * x;
      }
      slope /= squares;
      for (double hz = kSwayLow_Hz; hz < kSwayHigh_Hz; hz += kSwayStep_Hz) {
        double re = 0.0, im = 0.0;
        for (std::size_t i = a; i < b; ++i) {
          const double x = t_s[i] - 0.5 * (t_s[a] + t_s[b - 1]), w = 1.0 + std::cos(2.0 * std::numbers::pi * x / span);
          const double v = w * (y[i - a] - mean - slope * x), angle = 2.0 * std::numbers::pi * hz * x;
          re += v * std::cos(angle), im += v * std::sin(angle);
        }
        // |Σ w y|² dt² is a density times span times the window's mean square, 3/2.
        const double dt = span / n;
        power += 2.0 * (re * re + im * im) * dt * dt / (1.5 * span) * kSwayStep_Hz * span;
      }
      length += span;
    }
    a = b;
  }
  return length > 0.0 ? std::sqrt(power / length) : 0.0;
}

Vector4 as_vector(const std::array<double, 4>& a) { return {a[0], a[1], a[2], a[3]}; }

// A kind of defect: the changes that its unknowns make, and what those must be to be it.
struct ShareKind {
  std::vector<std::string> ids;
  std::vector<std::pair<std::string, std::string>> unknowns;  // name, unit
  Eigen::MatrixXd pattern;                                    // 4 rows
  // In words, what the estimate contradicts; empty when it may be.
  std::function<std::string(const Eigen::VectorXd&)> outside;
};

// Patterns of relative change. In the reference hover every rotor carries its share, whatever its gain: a demand that rises by g asks for
// g of that share more. Balance of force, roll and pitch moment and yaw torque then gives:
//   load m at (x, y): m/M (1 + x X_i / X² + y Y_i / Y²): no change of yaw. Its place must be within two arms.
//   a rotor that gives less thrust and torque alike at a given command: its own demand only.
//   one that loses the two in other proportion: besides, all four change by the reaction's sign to balance yaw. One that keeps its torque
//   does exactly as a load at its hub of a quarter of the thrust lost.
std::vector<ShareKind> kinds(const host::VehicleModel& v) {
  Vector4 x, y, spin;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    x(k) = v.rotors[i].position_m.x(), y(k) = v.rotors[i].position_m.y(), spin(k) = v.rotors[i].reaction;
  }
  const double X = std::sqrt(x.squaredNorm() / 4.0), Y = std::sqrt(y.squaredNorm() / 4.0);
  const Vector4 total = Vector4::Ones(), pitch = x / X, roll = y / Y;
  std::vector<ShareKind> out;
  const std::string &payload = effect("payload_mass").id, &weak = effect("weak_rotor").id, &com = effect("com_offset").id;
  const auto positive = [](const Eigen::VectorXd& c) { return c(0) < 0.0 ? std::string("a load below zero") : std::string(); };
  const auto loses = [](std::size_t count) {
    return [count](const Eigen::VectorXd& c) {
      for (std::size_t k = 0; k < count; ++k)
        if (c(static_cast<Eigen::Index>(k)) < kLeastLoss || c(static_cast<Eigen::Index>(k)) > kMostLoss / (1.0 - kMostLoss))
          return std::string("a loss outside 0 to 50 %");
      return std::string();
    };
  };
  const auto add = [&](std::vector<std::string> ids, std::vector<std::pair<std::string, std::string>> unknowns,
                       const std::vector<Vector4>& columns, auto outside) {
    Eigen::MatrixXd m(4, static_cast<Eigen::Index>(columns.size()));
    for (std::size_t k = 0; k < columns.size(); ++k) m.col(static_cast<Eigen::Index>(k)) = columns[k];
    out.push_back({std::move(ids), std::move(unknowns), std::move(m), outside});
  };
  add({payload}, {{"load", "of the weight"}}, {total}, positive);
  add({effect("body_torque_bias").id}, {{"yaw", "of the demand"}}, {spin}, [](const Eigen::VectorXd&) { return std::string(); });
  for (int i = 0; i < 4; ++i) add({fmt::format("{} {}", weak, i + 1)}, {{"demand", "1"}}, {Vector4::Unit(i)}, loses(1));
  for (int i = 0; i < 4; ++i) {
    const Vector4 below = total + pitch * x(i) / X + roll * y(i) / Y;
    add({fmt::format("{} at rotor {}", payload, i + 1)}, {{"load", "of the weight"}}, {below}, positive);
  }
  add({com}, {{"x", "of the arm"}, {"y", "of the arm"}}, {pitch, roll}, [](const Eigen::VectorXd&) { return std::string(); });
  for (int i = 0; i < 4; ++i)
    add({fmt::format("{} {}", weak, i + 1)}, {{"demand", "1"}, {"yaw", "of the demand"}}, {Vector4::Unit(i), spin}, loses(1));
  for (int i = 0; i < 4; ++i)
    for (int k = i + 1; k < 4; ++k)
      add({fmt::format("{} {}", weak, i + 1), fmt::format("{} {}", weak, k + 1)}, {{"demand", "1"}, {"demand", "1"}},
          {Vector4::Unit(i), Vector4::Unit(k)}, loses(2));
  add({payload, com}, {{"load", "of the weight"}, {"x", "of the arm"}, {"y", "of the arm"}}, {total, pitch, roll},
      [](const Eigen::VectorXd& c) {
        if (c(0) <= 0.0) return std::string("a load below zero");
        const double reach = std::max(std::abs(c(1)), std::abs(c(2))) / c(0);
        return reach > 2.0 ? fmt::format("the load would sit {:.1f} arms from the centre", reach) : std::string();
      });
  return out;
}

// 99th percentile of F(d, reference degrees of freedom), by the formula of Paulson from the normal's 2.326: good to a few per cent.
double f_limit(double d, double n) {
  const double z = 2.326, a = 2.0 / (9.0 * d), b = 2.0 / (9.0 * n), q = (1.0 - b) * (1.0 - b) - z * z * b;
  if (q <= 0.0) return 1e3;
  const double w = ((1.0 - b) * (1.0 - a) + z * std::sqrt((1.0 - b) * (1.0 - b) * a + (1.0 - a) * (1.0 - a) * b - z * z * a * b)) / q;
  return w * w * w;
}

HoverHypothesis judge(const ShareKind& kind, const Vector4& change, double u, double reference_degrees) {
  const Eigen::MatrixXd& A = kind.pattern;
  const LdltFactor normal(A.transpose() * A);
  const Eigen::VectorXd c = normal.solve(Eigen::VectorXd(A.transpose() * change));
  const Eigen::MatrixXd inverse = normal.inverse();
  HoverHypothesis h;
  h.ids = kind.ids;
  h.degrees = static_cast<int>(A.cols());
  for (Eigen::Index k = 0; k < c.size(); ++k) {
    const auto& [name, unit] = kind.unknowns[static_cast<std::size_t>(k)];
    h.parameters.push_back({name, unit, c(k), u * std::sqrt(inverse(k, k))});
  }
  const double left = 4.0 - static_cast<double>(A.cols());
  h.misfit = (change - A * c).squaredNorm() / (u * u * left);
  const double limit = f_limit(left, reference_degrees);
  h.ruled_out_by = kind.outside(c);
  if (h.ruled_out_by.empty() && h.misfit > limit)
    h.ruled_out_by = fmt::format("it leaves {:.1f} times the scatter of the reference, {:.1f} allowed", h.misfit, limit);
  return h;
}

std::string all_ids(const HoverHypothesis& h);

// What makes the same pattern and is indistinguishable from it by commands alone.
void add_indistinguishable(HoverDiagnosis& d) {
  if (d.named.size() != 1 || d.named[0].find('+') != std::string::npos) return;
  const auto number = d.named[0].rfind(' ');
  if (number == std::string::npos) return;  // of no one rotor
  const std::string rotor = d.named[0].substr(number);
  if (d.named[0].starts_with(effect("weak_rotor").id)) {
    d.named.push_back(effect("motor_resistance").id + rotor);
    d.remarks.push_back(
        "to distinguish them: change the propeller, then the motor; or log rotor speed, which a bad propeller raises and a bad motor does "
        "not");
  } else if (d.named[0].starts_with(effect("payload_mass").id + " at rotor")) {
    d.named.push_back(effect("blockage_strut").id + rotor);
    d.remarks.push_back("to distinguish them: weigh the vehicle; a rotor that loses thrust and keeps its torque needs the same commands");
  }
}

std::string all_ids(const HoverHypothesis& h) { return fmt::format("{}", fmt::join(h.ids, " + ")); }

}  // namespace

std::optional<HoverShare> hover_share(const log::FlightRecord& f, CommandMeaning meaning) {
  const Heights h = heights(f);
  if (h.t_s.empty() || f.motor_command.empty() || (meaning == CommandMeaning::duty && f.battery_V.empty())) return std::nullopt;
  const double usual = quantile(h.z_m, 0.75), ground = *std::min_element(h.z_m.begin(), h.z_m.end());
  HoverShare s;
  s.flight = f.name;
  std::vector<double> hover_t_s;
  std::size_t k = 0;
  double full = 0.0;
  for (std::size_t i = 0; i < h.t_s.size(); ++i) {
    if (h.z_m[i] < ground + 0.8 * (usual - ground) || std::abs(h.climb_m_s[i]) > kLevel_m_s) continue;
    while (k + 1 < f.motor_command.size() && f.motor_command.t_s[k + 1] <= h.t_s[i]) ++k;
    const log::RotorValues& u = f.motor_command.value[k];
    const double volts = f.battery_V.empty() ? 0.0 : interpolated(f.battery_V, h.t_s[i]);
    if (*std::min_element(u.begin(), u.end()) <= 0.0) continue;
    for (std::size_t r = 0; r < 4; ++r) s.demand[r] += meaning == CommandMeaning::thrust ? u[r] : std::pow(u[r] * volts, kThrustPerVoltage);
    full += *std::max_element(u.begin(), u.end()) >= kFull;
    s.battery_V += volts;
    hover_t_s.push_back(h.t_s[i]);
  }
  s.samples = hover_t_s.size();
  if (s.samples < kLeastHoverSamples) return std::nullopt;
  for (auto& d : s.demand) d /= static_cast<double>(s.samples);
  s.battery_V /= static_cast<double>(s.samples), s.saturated = full / static_cast<double>(s.samples);
  s.yaw_sway_rad = yaw_sway(f, hover_t_s);
  return s;
}

CommandMeaning command_meaning(const std::vector<log::FlightRecord>& reference) {
  const auto scatter = [&](CommandMeaning m) {
    std::vector<double> totals;
    for (const auto& f : reference)
      if (const auto s = hover_share(f, m)) totals.push_back(std::log(as_vector(s->demand).sum()));
    if (totals.size() < 2) return 1e300;
    double mean = 0.0, squares = 0.0;
    for (const double t : totals) mean += t / static_cast<double>(totals.size());
    for (const double t : totals) squares += (t - mean) * (t - mean);
    return squares;
  };
  return scatter(CommandMeaning::duty) < scatter(CommandMeaning::thrust) ? CommandMeaning::duty : CommandMeaning::thrust;
}

namespace {

// What the reference flights ask for, rotor by rotor, and how well they agree.
struct HoverReference {
  Vector4 demand = Vector4::Zero();
  double sway_rad = 0.0, scatter = 0.0, degrees = 0.0;
  explicit HoverReference(const std::vector<HoverShare>& flights) {
    const double n = static_cast<double>(flights.size());
    for (const auto& f : flights) demand += as_vector(f.demand) / n, sway_rad += f.yaw_sway_rad / n;
    double squares = 0.0;
    for (const auto& f : flights) squares += (as_vector(f.demand).cwiseQuotient(demand) - Vector4::Ones()).squaredNorm();
    degrees = 4.0 * (n - 1.0);
    scatter = std::max(kLeastScatter, std::sqrt(squares / degrees));
  }
};

// True when the yaw sways as under a load that swings.
bool remark_on_hover(const HoverShare& own, double reference_sway_rad, std::vector<std::string>& remarks) {
  const bool saturated = own.saturated > kSaturatedHover;
  if (saturated)
    remarks.push_back(
        fmt::format("a rotor is at full command in {:.0f} % of the hover: forces do not balance there, and sizes are lower bounds",
                    100.0 * own.saturated));
  if (reference_sway_rad > 0.0)
    remarks.push_back(fmt::format("yaw sways by {:.1f} mrad rms between {} and {} Hz, the reference by {:.1f}", 1e3 * own.yaw_sway_rad,
                                  kSwayLow_Hz, kSwayHigh_Hz, 1e3 * reference_sway_rad));
  return reference_sway_rad > 0.0 && own.yaw_sway_rad > kSway * reference_sway_rad && !saturated;
}

}  // namespace

HoverDiagnosis diagnose_hover(const log::FlightRecord& flight, const std::vector<log::FlightRecord>& reference, const host::VehicleModel& vehicle) {
  const CommandMeaning meaning = command_meaning(reference);
  std::vector<HoverShare> base;
  for (const auto& f : reference)
    if (auto s = hover_share(f, meaning)) base.push_back(*s);
  const auto own = hover_share(flight, meaning);
  if (base.size() < 2 || !own)
    throw Error(
        {flight.name,
         fmt::format("{} reference flights with 2 s of hover, at least 2 needed{}", base.size(), own ? "" : "; the flight itself has none"),
         "logs without motor commands, height or hover",
         "give flights of the same vehicle without the defect, each with some seconds of hover"},
        ExitCode::data_quality);
  const HoverReference usual(base);
  HoverDiagnosis d;
  d.share = *own;
  d.u = usual.scatter * std::sqrt(1.0 + 1.0 / static_cast<double>(base.size()));
  const Vector4 change = as_vector(own->demand).cwiseQuotient(usual.demand) - Vector4::Ones();
  for (std::size_t i = 0; i < 4; ++i) d.change[i] = change(static_cast<Eigen::Index>(i));
  d.remarks.push_back(meaning == CommandMeaning::thrust
                          ? "commands ask for thrust: the reference flights' total does not go with the battery"
                          : "commands are shares of the battery voltage");
  for (const auto& kind : kinds(vehicle)) d.hypotheses.push_back(judge(kind, change, d.u, usual.degrees));
  std::stable_sort(d.hypotheses.begin(), d.hypotheses.end(),
                   [](const auto& a, const auto& b) { return a.degrees != b.degrees ? a.degrees < b.degrees : a.misfit < b.misfit; });

  Eigen::Index largest = 0;
  change.maxCoeff(&largest);
  const bool changed = change.squaredNorm() / (4.0 * d.u * d.u) > f_limit(4.0, usual.degrees);
  if (change(largest) > kBeyond * d.u) d.rotor = static_cast<int>(largest) + 1;
  const bool swings = remark_on_hover(*own, usual.sway_rad, d.remarks);
  if (!changed) return d;
  if (swings && change.sum() > kBeyond * 2.0 * d.u) {
    // A load on a string away from the centre turns the body as it swings, which nothing that is fixed to it does.
    d.named.push_back(effect("slung_load").id);
    d.verdict = diagnose::DiagnosisVerdict::named;
    d.remarks.push_back(fmt::format("demand rises by {:.1f} ± {:.1f} % in total", 25.0 * change.sum(), 50.0 * d.u));
    return d;
  }
  // The fewest unknowns that explain the change; all that do with as many are a class.
  int fewest = 0;
  for (const auto& h : d.hypotheses) {
    if (!h.ruled_out_by.empty() || (fewest > 0 && h.degrees > fewest)) continue;
    fewest = h.degrees;
    d.named.push_back(all_ids(h));
  }
  add_indistinguishable(d);
  d.verdict = d.named.empty() ? diagnose::DiagnosisVerdict::unexplained : d.named.size() == 1 ? diagnose::DiagnosisVerdict::named : diagnose::DiagnosisVerdict::ambiguous;
  return d;
}

std::string hover_text(const HoverDiagnosis& d) {
  std::string s = fmt::format(
      "{}: {}{}\n  demand of rotors 1 to 4 changes by {:+.1f} {:+.1f} {:+.1f} {:+.1f} % (u {:.1f} %), battery {:.2f} V, {} samples\n",
      d.share.flight, name(d.verdict), d.named.empty() ? "" : fmt::format(": {}", fmt::join(d.named, " | ")), 100.0 * d.change[0],
      100.0 * d.change[1], 100.0 * d.change[2], 100.0 * d.change[3], 100.0 * d.u, d.share.battery_V, d.share.samples);
  if (d.rotor) s += fmt::format("  rotor {} is asked for most\n", *d.rotor);
  for (const auto& r : d.remarks) s += "  " + r + "\n";
  for (const auto& h : d.hypotheses) {
    s += fmt::format("    {:<32} misfit {:7.1f}", all_ids(h), h.misfit);
    for (const auto& p : h.parameters) s += fmt::format(", {} {:+.3f} ± {:.3f} {}", p.name, p.value, p.u, p.unit);
    s += (h.ruled_out_by.empty() ? "" : "; " + h.ruled_out_by) + "\n";
  }
  return s;
}

}  // namespace rotorloop::studies
