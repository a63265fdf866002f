// Sums over trials, limits, table, file.
#include "test/stats/identify_ensemble.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <ostream>
#include <sstream>

namespace rotorloop::stats {

EnsembleResult summarise(const std::vector<Quantity>& quantities, const std::vector<Trial>& trials) {
  EnsembleResult out;
  out.trials = trials.size();
  const double n = static_cast<double>(trials.size());
  for (const Trial& t : trials) out.not_converged += !t.converged;
  double parameters = 0.0;
  for (std::size_t i = 0; i < quantities.size(); ++i) {
    const Quantity& q = quantities[i];
    const double unit = q.relative ? std::fabs(q.truth) : 1.0;
    QuantityResult r;
    double squares = 0.0, variances = 0.0, z_squares = 0.0;
    for (const Trial& t : trials) {
      const Outcome& o = t.outcomes[i];
      const double error = (o.estimate - q.truth) / unit, u = o.u / unit, z = error / u;
      r.mean_error += error / n;
      squares += error * error;
      variances += u * u;
      r.mean_z += z / n;
      z_squares += z * z;
      r.within_2u += (std::fabs(z) <= 2.0) / n;
      r.within_2u_robust += (std::fabs(error) <= 2.0 * o.u_robust / unit) / n;
    }
    r.rms_error = std::sqrt(squares / n);
    r.mean_u = std::sqrt(variances / n);
    r.rms_z = std::sqrt(z_squares / n);
    out.quantity.push_back(r);
    if (!q.parameter) continue;
    parameters += 1.0;
    out.pooled_within_2u += r.within_2u;
    out.pooled_within_2u_robust += r.within_2u_robust;
    out.pooled_rms_z += z_squares / n;
  }
  out.pooled_within_2u /= parameters;
  out.pooled_within_2u_robust /= parameters;
  out.pooled_rms_z = std::sqrt(out.pooled_rms_z / parameters);
  return out;
}

std::vector<std::string> missed(const std::vector<Quantity>& quantities, const EnsembleResult& r, const EnsembleLimits& l) {
  std::vector<std::string> out;
  const auto range = [&](const std::string& what, double value, double from, double to, double scale, const char* unit) {
    if (!(value >= from && value <= to))
      out.push_back(fmt::format("{}: {:.3g}{}, allowed {:.3g} to {:.3g}{}", what, scale * value, unit, scale * from, scale * to, unit));
  };
  if (r.not_converged > 0) out.push_back(fmt::format("{} of {} fits did not converge", r.not_converged, r.trials));
  range("pooled share within 2u", r.pooled_within_2u, l.pooled_from, l.pooled_to, 100, " %");
  range("pooled rms z", r.pooled_rms_z, l.rms_z_from, l.rms_z_to, 1, "");
  for (std::size_t i = 0; i < quantities.size(); ++i) {
    const Quantity& q = quantities[i];
    const QuantityResult& one = r.quantity[i];
    if (q.parameter) {
      range(q.name + ": share within 2u", one.within_2u, l.each_from, l.each_to, 100, " %");
      range(q.name + ": rms z", one.rms_z, l.rms_z_from, l.rms_z_to, 1, "");
    }
    if (q.limit > 0.0 && !(3.0 * one.rms_error <= q.limit)) {
      const double scale = q.relative ? 100.0 : 1.0;
      const std::string unit = q.relative ? "%" : q.unit;
      out.push_back(fmt::format("{}: 3 x rms error {:.3g} {}, allowed {:.3g} {} (3 x the Cramér-Rao bound: {:.3g} {})", q.name,
                                3 * scale * one.rms_error, unit, scale * q.limit, unit, 3 * scale * one.mean_u, unit));
    }
  }
  return out;
}

void print_table(std::ostream& out, const std::vector<Quantity>& quantities, const EnsembleResult& r) {
  out << "| quantity | truth | mean error | 3 × rms error | limit | 3 × u (bound) | within 2u | rms z | mean z |\n"
         "| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n";
  for (std::size_t i = 0; i < quantities.size(); ++i) {
    const Quantity& q = quantities[i];
    const QuantityResult& one = r.quantity[i];
    // Percent, millimetres, milliradians, milliseconds.
    const double scale = q.relative ? 100.0 : 1000.0;
    const std::string unit = q.relative ? "%" : "m" + q.unit;
    out << fmt::format("| {} | {:.4g} {} | {:+.3f} {} | {:.3g} {} | {} | {:.3g} {} | {:.1f} % | {:.2f} | {:+.2f} |\n", q.name, q.truth,
                       q.unit, scale * one.mean_error, unit, 3 * scale * one.rms_error, unit,
                       q.limit > 0 ? fmt::format("{:.3g} {}", scale * q.limit, unit) : "–", 3 * scale * one.mean_u, unit,
                       100 * one.within_2u, one.rms_z, one.mean_z);
  }
  out << fmt::format(
      "\n{} trials, {} not converged. Pooled over the parameters: within 2u {:.2f} % (block-robust u: {:.2f} %), rms z {:.3f}.\n", r.trials,
      r.not_converged, 100 * r.pooled_within_2u, 100 * r.pooled_within_2u_robust, r.pooled_rms_z);
}

void print_shift(std::ostream& out, const std::vector<Quantity>& quantities, const std::vector<Trial>& changed,
                 const std::vector<Trial>& usual) {
  out << "| quantity | mean shift | its standard error | u of one estimate | u changed / usual |\n| --- | --- | --- | --- | --- |\n";
  std::size_t pairs = 0;
  for (std::size_t i = 0; i < quantities.size(); ++i) {
    const Quantity& q = quantities[i];
    const double scale = q.relative ? 100.0 / std::fabs(q.truth) : 1000.0;
    const std::string unit = q.relative ? "%" : "m" + q.unit;
    double n = 0.0, sum = 0.0, squares = 0.0, u = 0.0, ratio = 0.0;
    for (const Trial& c : changed) {
      const auto same = std::find_if(usual.begin(), usual.end(), [&](const Trial& t) { return t.seed == c.seed; });
      if (same == usual.end()) continue;
      const double d = scale * (c.outcomes[i].estimate - same->outcomes[i].estimate);
      n += 1.0;
      sum += d;
      squares += d * d;
      u += scale * same->outcomes[i].u;
      ratio += c.outcomes[i].u / same->outcomes[i].u;
    }
    pairs = static_cast<std::size_t>(n);
    const double mean = sum / n, error = n > 1.0 ? std::sqrt(std::max(0.0, squares / n - mean * mean) / (n - 1.0)) : std::nan("");
    out << fmt::format("| {} | {:+.3f} {} | {:.3f} | {:.3f} | {:.3f} |\n", q.name, mean, unit, error, u / n, ratio / n);
  }
  out << fmt::format("\n{} pairs of the same seed.\n", pairs);
}

std::string csv_header(const std::vector<Quantity>& quantities) {
  std::string s = "seed,converged,iterations,cost_per_dof,q_a,q_alpha,sigma_p,sigma_r";
  for (const Quantity& q : quantities) s += fmt::format(",{0}[{1}],u({0}),u_robust({0})", q.name, q.unit);
  return s;
}

std::string csv_line(const Trial& t) {
  std::string s = fmt::format("{},{},{},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g}", t.seed, int{t.converged}, t.iterations, t.cost_per_dof,
                              t.q_a_m_s2_rtHz, t.q_alpha_rad_s2_rtHz, t.pose_sigma_m, t.pose_sigma_rad);
  for (const Outcome& o : t.outcomes) s += fmt::format(",{:.9g},{:.5g},{:.5g}", o.estimate, o.u, o.u_robust);
  return s;
}

std::vector<Trial> read_trials(const std::filesystem::path& file, std::size_t quantities) {
  std::vector<Trial> out;
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::vector<double> v;
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) v.push_back(cell.empty() ? std::nan("") : std::stod(cell));
    if (v.size() != 8 + 3 * quantities || in.eof()) continue;  // a last line without its end was cut short
    Trial t;
    t.seed = static_cast<std::uint64_t>(v[0]);
    t.converged = v[1] != 0.0;
    t.iterations = static_cast<int>(v[2]);
    t.cost_per_dof = v[3];
    t.q_a_m_s2_rtHz = v[4];
    t.q_alpha_rad_s2_rtHz = v[5];
    t.pose_sigma_m = v[6];
    t.pose_sigma_rad = v[7];
    for (std::size_t i = 0; i < quantities; ++i) t.outcomes.push_back({v[8 + 3 * i], v[9 + 3 * i], v[10 + 3 * i]});
    out.push_back(std::move(t));
  }
  return out;
}

}  // namespace rotorloop::stats
