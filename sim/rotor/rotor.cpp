// Preparation of a rotor: quadrature nodes, section tables, azimuth directions. Runs once, before the loop.
#include "sim/rotor/rotor.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "host/base/elementary.hpp"
#include "host/base/error.hpp"
#include "sim/rotor/prandtl.hpp"

namespace rotorloop::sim {
namespace {
std::array<double, kPrandtlCells + 2> make_prandtl() {
  std::array<double, kPrandtlCells + 2> table{};
  for (int i = 0; i <= kPrandtlCells; ++i) {
    const double y = kPrandtlEnd * i / kPrandtlCells;
    table[static_cast<std::size_t>(i)] = 2.0 / std::numbers::pi * acos_exact(exp_exact(-y * y));
  }
  table[kPrandtlCells + 1] = table[kPrandtlCells];
  return table;
}

constexpr double kTipBend = 0.6;  // of the radial nodes; 0.3 to 0.8 do about as well

struct Node {
  double x, weight;  // on [-1, 1]
};

// Gauss-Legendre: roots of the Legendre polynomial by Newton from Tricomi's estimate.
std::vector<Node> gauss_legendre(int n) {
  std::vector<Node> nodes;
  for (int i = 0; i < n; ++i) {
    double x = -cos_exact(std::numbers::pi * (i + 0.75) / (n + 0.5)), slope = 1.0;
    for (int iteration = 0; iteration < 20; ++iteration) {
      double p0 = 1.0, p1 = x;
      for (int k = 2; k <= n; ++k) {
        const double p2 = ((2 * k - 1) * x * p1 - (k - 1) * p0) / k;
        p0 = p1;
        p1 = p2;
      }
      slope = n * (x * p1 - p0) / (x * x - 1.0);
      x -= p1 / slope;
    }
    nodes.push_back({x, 2.0 / ((1.0 - x * x) * slope * slope)});
  }
  return nodes;
}

// Value at x between the points (x[i], y[i]), i = at - 1 and at: cubic with the slopes of Fritsch & Butland (1984), which keep it between
// its neighbours. Straight lines would do for the shape, but their kinks cost quadrature nodes.
template <class X, class Y>
double monotone_cubic(std::size_t count, std::size_t at, double x, X abscissa, Y ordinate) {
  const auto secant = [&](std::size_t i) { return (ordinate(i + 1) - ordinate(i)) / (abscissa(i + 1) - abscissa(i)); };
  const auto slope = [&](std::size_t i) {
    if (i == 0) return secant(0);
    if (i + 1 == count) return secant(count - 2);
    const double left = secant(i - 1), right = secant(i);
    if (left * right <= 0.0) return 0.0;
    const double hl = abscissa(i) - abscissa(i - 1), hr = abscissa(i + 1) - abscissa(i);
    return 3.0 * (hl + hr) / ((2.0 * hr + hl) / left + (hr + 2.0 * hl) / right);
  };
  const double h = abscissa(at) - abscissa(at - 1), t = std::clamp((x - abscissa(at - 1)) / h, 0.0, 1.0);
  const double t2 = t * t, t3 = t2 * t;
  return ordinate(at - 1) * (2.0 * t3 - 3.0 * t2 + 1.0) + slope(at - 1) * h * (t3 - 2.0 * t2 + t) + ordinate(at) * (3.0 * t2 - 2.0 * t3) +
         slope(at) * h * (t3 - t2);
}

void check(const RotorResolution& r) {
  const auto refuse = [](const std::string& what, const std::string& remedy) { throw Error({"rotor resolution", what, "", remedy}); };
  if (r.radial < 4 || r.radial > kMaxRadial)
    refuse("radial = " + std::to_string(r.radial) + " is outside 4 to 64 nodes", "use 22, or 64 for a reference");
  if (r.azimuth < 8 || r.azimuth > kMaxAzimuth || r.azimuth % 4 != 0)
    refuse("azimuth = " + std::to_string(r.azimuth) + " is not a multiple of 4 in 8 to 128 nodes", "use 16, or 128 for a reference");
  if (r.max_iterations < 1) refuse("max_iterations = " + std::to_string(r.max_iterations) + " is below 1", "use 80");
}
}  // namespace

const std::array<double, kPrandtlCells + 2> kPrandtlTable = make_prandtl();

Rotor::Rotor(const Blade& blade, RotorResolution resolution)
    : resolution_(resolution),
      radius_m_(blade.radius_m),
      hub_radius_m_(blade.hub_radius_m),
      area_m2_(std::numbers::pi * (blade.radius_m * blade.radius_m - blade.hub_radius_m * blade.hub_radius_m)),
      blade_inertia_kg_m2_(blade.blade_inertia_kg_m2),
      blades_(blade.blades) {
  check(resolution);
  const auto& s = blade.stations;
  std::vector<SectionTable> tables;
  const double span = radius_m_ - hub_radius_m_;
  for (const Node& node : gauss_legendre(resolution.radial)) {
    // Over x in [0, 1], r / span = (1 - b) x + b sin(pi x / 2): denser towards the tip, where Prandtl's loss falls like a square
    // root, and even at the root, which carries little. A full bend (b = 1), or one at the root too, leaves too few nodes between.
    const double x = 0.5 * (1.0 + node.x);
    const SinCos bent = sincos_exact(0.5 * std::numbers::pi * x);
    const double r = hub_radius_m_ + span * ((1.0 - kTipBend) * x + kTipBend * bent.sin);
    const double slope = (1.0 - kTipBend) + kTipBend * 0.5 * std::numbers::pi * bent.cos;
    std::size_t i = 1;
    while (i + 1 < s.size() && s[i].r_m < r) ++i;
    const BladeStation &in = s[i - 1], &out = s[i];
    const double w = std::clamp((r - in.r_m) / (out.r_m - in.r_m), 0.0, 1.0);
    const auto radius = [&](std::size_t j) { return s[j].r_m; };
    const double chord = monotone_cubic(s.size(), i, r, radius, [&](std::size_t j) { return s[j].chord_m; });
    const double twist_deg = blade.pitch_offset_deg + monotone_cubic(s.size(), i, r, radius, [&](std::size_t j) { return s[j].twist_deg; });
    const SinCos twist = sincos_exact(twist_deg * std::numbers::pi / 180.0);
    const double snel = blade.stall_delay * (chord / r) * (chord / r);
    const double stall_delay = 1.0 - 2.0 / (1.0 + exp_exact(2.0 * std::min(snel, 20.0)));  // tanh(snel)
    tables.push_back(prepare_section(blade.polars.at(in.polar), blade.polars.at(out.polar), w, twist_deg,
                                     {.stall_delay_share = stall_delay,
                                      .stall_drag = blade.stall_drag,
                                      .drag_scale = blade.drag_scale,
                                      .lift_scale = blade.lift_scale}));
    annuli_.push_back({.r_m = r,
                       .chord_m = chord,
                       .weight_m = 0.5 * node.weight * span * slope,
                       .cos_twist = twist.cos,
                       .sin_twist = twist.sin,
                       .solidity = blades_ * chord / (2.0 * std::numbers::pi * r),
                       .sqrt_tip_loss = std::sqrt(0.5 * blades_ * (radius_m_ - r) / r),
                       .sqrt_root_loss = std::sqrt(0.5 * blades_ * (r - hub_radius_m_) / hub_radius_m_),
                       .table = static_cast<int>(tables.size()) - 1});
  }
  tables_ = std::make_shared<const std::vector<SectionTable>>(std::move(tables));
  fill_lanes();
  // Quarter turns copy one another exactly, so that a quarter turn of the wind turns the loads exactly.
  const int n = resolution.azimuth;
  for (int k = 0; k < n / 4; ++k) {
    const SinCos first = sincos_exact(2.0 * std::numbers::pi * (k + 0.5) / n);
    const double c[4] = {first.cos, -first.sin, -first.cos, first.sin}, d[4] = {first.sin, first.cos, -first.sin, -first.cos};
    for (int quarter = 0; quarter < 4; ++quarter) {
      cos_psi_[static_cast<std::size_t>(k + quarter * n / 4)] = c[quarter];
      sin_psi_[static_cast<std::size_t>(k + quarter * n / 4)] = d[quarter];
    }
  }
}

// The kernel's copy of the annuli, filled up with the last one to whole registers.
void Rotor::fill_lanes() {
  const std::size_t count = annuli_.size(), filled = (count + kernel::kWidest - 1) / kernel::kWidest * kernel::kWidest;
  for (std::size_t i = 0; i < filled; ++i) {
    const Annulus& a = annuli_[std::min(i, count - 1)];
    const SectionTable& t = table(a.table);
    lanes_.r_m[i] = a.r_m;
    lanes_.relative_r[i] = a.r_m / radius_m_;
    lanes_.sqrt_tip_loss[i] = a.sqrt_tip_loss;
    lanes_.sqrt_root_loss[i] = a.sqrt_root_loss;
    lanes_.thrust_scale[i] = 0.25 * a.solidity / resolution_.azimuth;
    lanes_.rows_per_reynolds_m[i] = a.chord_m / t.reynolds_step;
    lanes_.row_zero[i] = t.reynolds_min / t.reynolds_step;
    lanes_.nodes[i] = &t.nodes.front().up;
  }
}

}  // namespace rotorloop::sim
