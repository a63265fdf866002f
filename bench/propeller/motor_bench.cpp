// The chain and its fit. The report is in motor_bench_report.cpp.
#include "bench/propeller/motor_bench.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>

#include "bench/propeller/scaled_blade.hpp"
#include "host/base/error.hpp"
#include "sim/rotor/bem.hpp"

namespace rotorloop::propeller {
namespace {
// Rise and fall of a switch of such an ESC together, and its usual frequency: 1 W at full throttle, not worth fitting.
constexpr double kSwitchingTime_s = 100e-9, kPwm_Hz = 24e3;
constexpr sim::RotorResolution kStaticResolution{.radial = 12, .azimuth = 8};  // no edgewise flow: all azimuths alike

// Residuals are errors over what is tolerated: the limits, and near zero what the stand itself leaves open. Thrust: without a
// propeller it reads up to 0.035 N. Current: the second digit of a hall sensor for tens of amperes (assumed).
constexpr double kThrustFloor_N = 0.035, kCurrentFloor_A = 0.05;

struct Scalar {
  const char* name;
  const char* unit;
  double BenchParameters::*member;
  double min, max, difference;
};
constexpr std::array<Scalar, 6> kScalars = {{
    {"resistance", "ohm", &BenchParameters::resistance_ohm, 0.02, 0.4, 1e-3},
    {"phase inductance", "H", &BenchParameters::phase_inductance_H, 0.0, 60e-6, 5e-7},
    {"pitch offset", "deg", &BenchParameters::pitch_offset_deg, -8.0, 8.0, 0.1},
    {"chord scale", "1", &BenchParameters::chord_scale, 0.3, 1.6, 0.01},
    {"drag scale", "1", &BenchParameters::drag_scale, 0.5, 4.0, 0.02},
    {"twist under load", "deg", &BenchParameters::twist_deg, -10.0, 10.0, 0.1},
}};
const Scalar& scalar(BenchScalar s) { return kScalars[static_cast<std::size_t>(s)]; }

sim::Blade bench_blade(const sim::Blade& reference, const BenchParameters& p, double omega_rad_s) {
  sim::Blade blade = scaled_blade(reference, kBenchRadius_m, kBenchPitchRatio);
  const double speed = omega_rad_s / kTwistSpeed_rad_s;
  for (sim::BladeStation& s : blade.stations) {
    s.chord_m *= p.chord_scale;
    s.twist_deg += p.pitch_offset_deg + p.twist_deg * speed * speed;
  }
  blade.drag_scale = p.drag_scale;
  return blade;
}

// Current of the conducting pair from the power balance of a motor that turns at a known speed.
double current_from_power(const sim::SixStepParameters& electrical, const MotorBenchRow& row) {
  const double emf_V = electrical.emf_constant_V_s * row.omega_rad_s + 0.5 * row.bus_V * electrical.switching_time_s * electrical.pwm_Hz;
  const double r = electrical.resistance_ohm;
  return (std::sqrt(emf_V * emf_V + 4.0 * r * row.bus_V * row.bus_A) - emf_V) / (2.0 * r);
}

class Chain {
 public:
  Chain(const MotorBenchData& data, const sim::Blade& reference) : data_(data), reference_(reference) {}

  struct Prepared {
    sim::SixStepParameters drive;
    EscCalibration esc;
    std::shared_ptr<const PropellerCurve> propeller;
  };
  Prepared prepare(const BenchParameters& p) {
    Prepared x{six_step_parameters(p, data_.propeller.pole_pairs), {}, curve(p)};
    x.esc = calibrate_esc(data_.motor_alone, x.drive);
    x.drive.static_friction_N_m = x.esc.static_friction_N_m;
    x.drive.viscous_friction_N_m_s = x.esc.viscous_friction_N_m_s;
    return x;
  }
  static BenchValues predict(const Prepared& x, const MotorBenchRow& row, double* overlap_share = nullptr) {
    const sim::SixStepPoint s = sim::six_step_steady(x.drive, row.bus_V, x.esc.duty_at(row.throttle),
                                                     [&](double omega_rad_s) { return x.propeller->torque_N_m(omega_rad_s); });
    if (overlap_share != nullptr) *overlap_share = s.overlap_share;
    return {s.omega_rad_s, s.bus_current_A, x.propeller->thrust_N(s.omega_rad_s)};
  }

 private:
  // Electrical derivatives of the fit need no new propeller.
  std::shared_ptr<const PropellerCurve> curve(const BenchParameters& p) {
    const std::array<double, 4> key = {p.pitch_offset_deg, p.chord_scale, p.drag_scale, p.twist_deg};
    std::shared_ptr<const PropellerCurve>& kept = curves_[key];
    if (!kept) kept = std::make_shared<const PropellerCurve>(reference_, p);
    return kept;
  }
  const MotorBenchData& data_;
  const sim::Blade& reference_;
  std::map<std::array<double, 4>, std::shared_ptr<const PropellerCurve>> curves_;
};

MotorBenchResult fit_chain(Chain& chain, const MotorBenchData& data, const BenchForm& form, const std::vector<std::size_t>& held_out,
                           const BenchParameters& start) {
  const std::vector<MotorBenchRow>& rows = data.propeller.rows;
  const auto is_held_out = [&](std::size_t i) { return std::find(held_out.begin(), held_out.end(), i) != held_out.end(); };
  const auto with = [&](const std::vector<double>& values) {
    BenchParameters p = start;
    for (std::size_t i = 0; i < form.size(); ++i) p.*scalar(form[i]).member = values[i];
    return p;
  };
  const auto residuals = [&](const std::vector<double>& values) {
    const Chain::Prepared x = chain.prepare(with(values));
    Eigen::VectorXd r(static_cast<Eigen::Index>(3 * (rows.size() - held_out.size())));
    Eigen::Index at = 0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (is_held_out(i)) continue;
      const BenchValues v = Chain::predict(x, rows[i]);
      r[at++] = (v.omega_rad_s - rows[i].omega_rad_s) / (kBenchLimits.omega * rows[i].omega_rad_s);
      r[at++] = (v.bus_A - rows[i].bus_A) / std::hypot(kBenchLimits.bus_A * rows[i].bus_A, kCurrentFloor_A);
      r[at++] = (v.thrust_N - rows[i].thrust_N) / std::hypot(kBenchLimits.thrust * rows[i].thrust_N, kThrustFloor_N);
    }
    return r;
  };
  std::vector<BoundedParameter> parameters;
  for (const BenchScalar s : form)
    parameters.push_back({scalar(s).name, scalar(s).unit, start.*scalar(s).member, scalar(s).min, scalar(s).max, scalar(s).difference});

  MotorBenchResult result;
  result.form = form;
  result.fit = fit_least_squares(parameters, residuals);
  result.fitted_rms = result.fit.rms;
  result.parameters = with(result.fit.values);
  const Chain::Prepared fitted = chain.prepare(result.parameters), unfitted = chain.prepare({});
  result.esc = fitted.esc;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    BenchComparison c;
    c.throttle = rows[i].throttle;
    c.held_out = is_held_out(i);
    c.measured = {rows[i].omega_rad_s, rows[i].bus_A, rows[i].thrust_N};
    c.fitted = Chain::predict(fitted, rows[i], &c.overlap_share);
    c.unfitted = Chain::predict(unfitted, rows[i]);
    if (c.held_out) {
      const BenchValues e = c.relative_error();
      BenchValues& w = result.worst_held_out;
      w = {std::max(w.omega_rad_s, std::fabs(e.omega_rad_s)), std::max(w.bus_A, std::fabs(e.bus_A)),
           std::max(w.thrust_N, std::fabs(e.thrust_N))};
    }
    result.rows.push_back(c);
  }
  return result;
}
}  // namespace

PropellerCurve::PropellerCurve(const sim::Blade& reference, const BenchParameters& p) {
  for (std::size_t i = 0; i < kNodes; ++i) {
    sim::RotorCondition c;
    c.omega_rad_s = kStep_rad_s * static_cast<double>(i + 1);
    c.density_kg_m3 = kBenchDensity_kg_m3;
    sim::RotorWarmStart cold;
    const sim::RotorLoads loads = sim::solve_rotor(sim::Rotor(bench_blade(reference, p, c.omega_rad_s), kStaticResolution), c, cold);
    const double omega2 = c.omega_rad_s * c.omega_rad_s;
    thrust_N_s2_[i] = loads.force_R_N.z() / omega2;
    torque_N_m_s2_[i] = loads.shaft_torque_N_m / omega2;
  }
}

double PropellerCurve::at(const Table& table, double omega_rad_s) {
  const double x = std::clamp(omega_rad_s / kStep_rad_s - 1.0, 0.0, static_cast<double>(kNodes - 1));
  const auto i = std::min(static_cast<std::size_t>(x), kNodes - 2);
  return (table[i] + (x - static_cast<double>(i)) * (table[i + 1] - table[i])) * omega_rad_s * omega_rad_s;
}

double EscCalibration::duty_at(double at) const {
  std::size_t i = 1;
  while (i + 1 < throttle.size() && throttle[i] < at) ++i;
  return duty[i - 1] + (duty[i] - duty[i - 1]) * (at - throttle[i - 1]) / (throttle[i] - throttle[i - 1]);
}

sim::SixStepParameters six_step_parameters(const BenchParameters& p, int pole_pairs) {
  sim::SixStepParameters s;
  s.emf_constant_V_s = sim::six_step_emf_constant_V_s(kBenchSpeedConstant_rpm_V);
  s.resistance_ohm = p.resistance_ohm;
  s.phase_inductance_H = p.phase_inductance_H;
  s.pole_pairs = pole_pairs;
  s.switching_time_s = kSwitchingTime_s;
  s.pwm_Hz = kPwm_Hz;
  return s;
}

EscCalibration calibrate_esc(const MotorBenchFile& motor_alone, const sim::SixStepParameters& electrical) {
  EscCalibration c;
  double n = 0.0, sum_w = 0.0, sum_ww = 0.0, sum_q = 0.0, sum_wq = 0.0;
  std::vector<double> torque;
  for (const MotorBenchRow& row : motor_alone.rows) {
    const double current_A = current_from_power(electrical, row);
    c.throttle.push_back(row.throttle);
    c.duty.push_back(sim::six_step_duty(electrical, row.bus_V, row.omega_rad_s, current_A));
    torque.push_back(electrical.emf_constant_V_s * current_A);
    n += 1.0;
    sum_w += row.omega_rad_s;
    sum_ww += row.omega_rad_s * row.omega_rad_s;
    sum_q += torque.back();
    sum_wq += row.omega_rad_s * torque.back();
  }
  c.viscous_friction_N_m_s = (n * sum_wq - sum_w * sum_q) / (n * sum_ww - sum_w * sum_w);
  c.static_friction_N_m = (sum_q - c.viscous_friction_N_m_s * sum_w) / n;
  double rss = 0.0;
  for (std::size_t i = 0; i < torque.size(); ++i) {
    const double miss = torque[i] - c.static_friction_N_m - c.viscous_friction_N_m_s * motor_alone.rows[i].omega_rad_s;
    rss += miss * miss;
  }
  c.friction_rms_N_m = std::sqrt(rss / n);
  if (c.throttle.back() < 1.0) {
    c.throttle.push_back(1.0);
    c.duty.push_back(1.0);
  }
  return c;
}

BenchValues BenchComparison::relative_error() const {
  return {fitted.omega_rad_s / measured.omega_rad_s - 1.0, fitted.bus_A / measured.bus_A - 1.0, fitted.thrust_N / measured.thrust_N - 1.0};
}

MotorBenchData read_motor_bench_data(const std::filesystem::path& data_folder) {
  const std::filesystem::path folder = data_folder / "propellers" / "motor_esc_bench_ark";
  MotorBenchData data{read_motor_bench(folder / "ARK_4IN1_F051_HQ5136.json"), read_motor_bench(folder / "ARK_4IN1_F051.json")};
  if (data.motor_alone.propeller != "none" || data.motor_alone.motor != data.propeller.motor)
    throw Error({data.motor_alone.name.generic_string(),
                 "meta.prop = \"" + data.motor_alone.propeller + "\", motor \"" + data.motor_alone.motor + "\": expected \"none\" and \"" +
                     data.propeller.motor + "\"",
                 "files exchanged", "give the same motor's capture without a propeller"},
                ExitCode::data_quality);
  return data;
}

MotorBenchResult fit_motor_bench(const MotorBenchData& data, const sim::Blade& reference, const BenchForm& form,
                                 const std::vector<std::size_t>& held_out, const BenchParameters& start) {
  Chain chain(data, reference);
  return fit_chain(chain, data, form, held_out, start);
}

LeaveTwoOut leave_two_out(const MotorBenchData& data, const sim::Blade& reference, const BenchParameters& start) {
  Chain chain(data, reference);
  LeaveTwoOut all;
  BenchValues sum;
  for (std::size_t a = 0; a < data.propeller.rows.size(); ++a)
    for (std::size_t b = a + 1; b < data.propeller.rows.size(); ++b) {
      const MotorBenchResult r = fit_chain(chain, data, kBenchForm, {a, b}, start);
      const BenchValues w = r.worst_held_out;
      ++all.choices;
      if (within_limits(r)) ++all.within;
      for (const std::size_t i : {a, b}) {
        const BenchValues e = r.rows[i].relative_error();
        sum = {sum.omega_rad_s + e.omega_rad_s * e.omega_rad_s, sum.bus_A + e.bus_A * e.bus_A, sum.thrust_N + e.thrust_N * e.thrust_N};
      }
      all.worst = {std::max(all.worst.omega_rad_s, w.omega_rad_s), std::max(all.worst.bus_A, w.bus_A),
                   std::max(all.worst.thrust_N, w.thrust_N)};
    }
  const double n = 2.0 * all.choices;
  all.rms = {std::sqrt(sum.omega_rad_s / n), std::sqrt(sum.bus_A / n), std::sqrt(sum.thrust_N / n)};
  return all;
}

bool within_limits(const MotorBenchResult& r) {
  const BenchValues& w = r.worst_held_out;
  return w.omega_rad_s <= kBenchLimits.omega && w.bus_A <= kBenchLimits.bus_A && w.thrust_N <= kBenchLimits.thrust;
}

MotorBenchResult validate_motor_bench(const std::filesystem::path& data_folder, const std::filesystem::path& blade_file) {
  return fit_motor_bench(read_motor_bench_data(data_folder), sim::read_blade(blade_file));
}

}  // namespace rotorloop::propeller
