// What the fit takes for granted of every term: derivatives by its parameters and by the motion are exact, and a mirrored flight of a
// mirrored vehicle has the mirrored load.
#include <gtest/gtest.h>

#include <set>
#include <string>

#include "host/effects/mass_geometry.hpp"
#include "host/effects/rotor_thrust_terms.hpp"
#include "test/unit/host/effects/flown.hpp"

namespace rotorloop::host {
namespace {

// Away from neutral, inside the bounds, different for each parameter.
std::vector<double> acting(const Term& t) {
  std::vector<double> v;
  double share = 0.3;
  for (const TermParameter& p : t.info.parameters) {
    double x = p.neutral + share * p.scale;
    if (x > p.max) x = p.neutral - share * p.scale;
    v.push_back(x);
    share += 0.1;
  }
  return v;
}

// A flight in which every law acts and none has a kink: tilted, low over the ground, moving in all directions.
LoadInput<double> busy_flight() {
  LoadInput<double> in = general_flight();
  const Eigen::Matrix3d world_B = (Eigen::Quaterniond(0.9, 0.2, -0.3, 0.25).normalized().toRotationMatrix()).transpose();
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::Vector3d e = world_B.col(static_cast<Eigen::Index>(k));
    in.world_B[k] = {e.x(), e.y(), e.z()};
  }
  in.p_W_m = {0.7, -0.4, 0.3};
  return in;
}
LoadInput<double> ring_state() {
  LoadInput<double> in = busy_flight();
  in.v_B_m_s = {1.5, -2.0, -6.5};
  return in;
}

std::array<double, 6> rows(const Wrench& w) { return {w.force.x(), w.force.y(), w.force.z(), w.torque.x(), w.torque.y(), w.torque.z()}; }
template <class S>
std::array<const S*, 6> rows(const LoadState<S>& s) {
  return {&s.force_B_N.x, &s.force_B_N.y, &s.force_B_N.z, &s.torque_B_N_m.x, &s.torque_B_N_m.y, &s.torque_B_N_m.z};
}
template <class S>
Vec3<S> lifted(const Vec3<double>& v) {
  return {S(v.x), S(v.y), S(v.z)};
}
template <class S>
LoadInput<S> lifted(const LoadInput<double>& in) {
  LoadInput<S> out;
  out.v_B_m_s = lifted<S>(in.v_B_m_s);
  out.rates_B_rad_s = lifted<S>(in.rates_B_rad_s);
  out.p_W_m = lifted<S>(in.p_W_m);
  for (std::size_t k = 0; k < 3; ++k) out.world_B[k] = lifted<S>(in.world_B[k]);
  for (std::size_t i = 0; i < kRotors; ++i) {
    out.omega_rad_s[i] = S(in.omega_rad_s[i]);
    out.omega_dot_rad_s2[i] = S(in.omega_dot_rad_s2[i]);
  }
  return out;
}
template <class S>
LoadParameters<S> lifted(const LoadParameters<double>& p) {
  return {S(p.k1_N_s2), S(p.k2_N_s2_m), S(p.c_q_N_m_s2), S(p.com_x_m), S(p.com_y_m), S(p.c_dh_s_m), S(p.c_dxy_N_s2_m2), S(p.c_dz_N_s2_m2)};
}

void expect_slope(double exact, double up, double down, double step, const std::string& where) {
  const double slope = (up - down) / (2 * step), noise = 1e-13 * std::max(1.0, std::fabs(up)) / step;
  EXPECT_NEAR(exact, slope, 2e-6 * std::fabs(slope) + 10 * noise) << where;
}

class EveryTerm : public testing::TestWithParam<const Term*> {};

TEST_P(EveryTerm, HasExactDerivativesByItsParameters) {
  const Term& t = *GetParam();
  const TermList list = only(t);
  const std::vector<double> values = acting(t);
  for (const LoadInput<double>& flight : {busy_flight(), ring_state()}) {
    const LoadInput<ExtraDual> in = lifted<ExtraDual>(flight);
    const LoadParameters<ExtraDual> p = lifted<ExtraDual>(load_parameters(paper_vehicle()));
    const LoadGeometry g = load_geometry(paper_vehicle());
    std::vector<ExtraDual> c;
    for (std::size_t k = 0; k < values.size(); ++k) c.push_back(ExtraDual::variable(values[k], static_cast<int>(k)));
    LoadState<ExtraDual> s{in, p, g, {}, {}, {}, {}, {}, {}, {}};
    const auto memory = memory_in_flight<ExtraDual>(list);
    const TermSet<ExtraDual> set(list, c.data(), memory.empty() ? nullptr : memory.data());
    loads(s, &set);
    for (std::size_t k = 0; k < values.size(); ++k) {
      const double e = 1e-4 * t.info.parameters[k].scale;
      auto up = values, down = values;
      up[k] += e;
      down[k] -= e;
      const auto a = rows(wrench(flight, list, up)), b = rows(wrench(flight, list, down));
      for (std::size_t i = 0; i < 6; ++i)
        expect_slope(rows(s)[i]->d[k], a[i], b[i], e, std::string(t.info.parameters[k].name) + ", row " + std::to_string(i));
    }
  }
}

TEST_P(EveryTerm, HasExactDerivativesByMotionAttitudePlaceAndThePapersParameters) {
  const Term& t = *GetParam();
  const TermList list = only(t);
  const std::vector<double> values = acting(t);
  using D = PlaceDual;
  for (const LoadInput<double>& flight : {busy_flight(), ring_state()}) {
    // 20 numbers: velocity, rates, attitude (small turn of the body), place, parameters.
    const LoadParameters<double> p0 = load_parameters(paper_vehicle());
    const std::array<double, 8> p_at{p0.k1_N_s2, p0.k2_N_s2_m, p0.c_q_N_m_s2,    p0.com_x_m,
                                     p0.com_y_m, p0.c_dh_s_m,  p0.c_dxy_N_s2_m2, p0.c_dz_N_s2_m2};
    const auto state = [&]<class S>(const std::array<S, 20>& x) {
      LoadInput<S> in = lifted<S>(flight);
      in.v_B_m_s += Vec3<S>{x[0], x[1], x[2]};
      in.rates_B_rad_s += Vec3<S>{x[3], x[4], x[5]};
      for (auto& e : in.world_B) e += cross(e, Vec3<S>{x[6], x[7], x[8]});
      in.p_W_m += Vec3<S>{x[9], x[10], x[11]};
      return in;
    };
    const auto parameters = [&]<class S>(const std::array<S, 20>& x) {
      return LoadParameters<S>{x[12] + p_at[0], x[13] + p_at[1], x[14] + p_at[2], x[15] + p_at[3],
                               x[16] + p_at[4], x[17] + p_at[5], x[18] + p_at[6], x[19] + p_at[7]};
    };
    const LoadGeometry g = load_geometry(paper_vehicle());
    std::array<D, 20> x;
    for (std::size_t j = 0; j < 20; ++j) x[j] = D::variable(0.0, static_cast<int>(j));
    const LoadInput<D> in = state(x);
    const LoadParameters<D> p = parameters(x);
    std::vector<D> c(values.begin(), values.end());
    LoadState<D> s{in, p, g, {}, {}, {}, {}, {}, {}, {}};
    const auto memory = memory_in_flight<D>(list);
    const TermSet<D> set(list, c.data(), memory.empty() ? nullptr : memory.data());
    loads(s, &set);
    const auto plain = [&](std::size_t j, double e) {
      std::array<double, 20> y{};
      y[j] = e;
      const LoadInput<double> at = state(y);
      const LoadParameters<double> q = parameters(y);
      LoadState<double> o{at, q, g, {}, {}, {}, {}, {}, {}, {}};
      const auto plain_memory = memory_in_flight<double>(list);
      const TermSet<double> plain_set(list, values.data(), plain_memory.empty() ? nullptr : plain_memory.data());
      loads(o, &plain_set);
      std::array<double, 6> r;
      for (std::size_t i = 0; i < 6; ++i) r[i] = *rows(o)[i];
      return r;
    };
    for (std::size_t j = 0; j < 20; ++j) {
      const double e = j < 12 ? 1e-5 : 1e-4 * std::fabs(p_at[j - 12]);
      const auto a = plain(j, e), b = plain(j, -e);
      for (std::size_t i = 0; i < 6; ++i)
        expect_slope(rows(s)[i]->d[j], a[i], b[i], e, "direction " + std::to_string(j) + ", row " + std::to_string(i));
    }
  }
}

// Parameters that change sign when left and right are exchanged; those of single rotors change places instead.
bool odd(const std::string& id, const std::string& name) {
  static const std::set<std::string> kOdd{
      "wind_steady.w_y_m_s",      "wind_shear.gradient_y_1_s",  "com_offset.dy_m",     "rotor_tilt.lean_y_rad",  "rotor_tilt.twist_rad",
      "tether.pull_y_N",          "drag_centre_offset.y_m",     "body_force_bias.y_N", "body_torque_bias.x_N_m", "body_torque_bias.z_N_m",
      "gravity_tilt.about_x_rad", "payload_mass.moment_y_kg_m", "world_force.y_N"};
  return kOdd.contains(id + "." + name);
}
constexpr std::array<std::size_t, 4> kMirrorRotor{2, 3, 0, 1};  // front right - front left, rear left - rear right
Vec3<double> mirrored(const Vec3<double>& v) { return {v.x, -v.y, v.z}; }
Vec3<double> mirrored_axial(const Vec3<double>& v) { return {-v.x, v.y, -v.z}; }

TEST_P(EveryTerm, LoadsAMirroredFlightWithTheMirroredForceAndTorque) {
  const Term& t = *GetParam();
  VehicleModel m = paper_vehicle();
  m.com_offset_m.y() = 0.0;
  const std::vector<double> values = acting(t);
  std::vector<double> mirrored_values = values;
  for (std::size_t k = 0; k < values.size(); ++k) {
    const std::string name(t.info.parameters[k].name);
    if (odd(std::string(t.info.id), name)) mirrored_values[k] = -values[k];
    if (name.ends_with("_1") && values.size() == 4) {
      for (std::size_t r = 0; r < 4; ++r) mirrored_values[r] = values[kMirrorRotor[r]];
    }
  }
  const LoadInput<double> in = busy_flight();
  LoadInput<double> other = in;
  other.v_B_m_s = mirrored(in.v_B_m_s);
  other.rates_B_rad_s = mirrored_axial(in.rates_B_rad_s);
  other.p_W_m = mirrored(in.p_W_m);
  for (std::size_t k = 0; k < 3; ++k) other.world_B[k] = scaled(k == 1 ? -1.0 : 1.0, mirrored(in.world_B[k]));
  for (std::size_t r = 0; r < 4; ++r) {
    other.omega_rad_s[r] = in.omega_rad_s[kMirrorRotor[r]];
    other.omega_dot_rad_s2[r] = in.omega_dot_rad_s2[kMirrorRotor[r]];
  }
  const Wrench a = wrench(m, in, only(t), values), b = wrench(m, other, only(t), mirrored_values);
  EXPECT_LT((b.force - Eigen::Vector3d(a.force.x(), -a.force.y(), a.force.z())).norm(), 1e-12);
  EXPECT_LT((b.torque - Eigen::Vector3d(-a.torque.x(), a.torque.y(), -a.torque.z())).norm(), 1e-13);
}

TEST_P(EveryTerm, ActsInFlightWhenItsParametersLeaveNeutral) {
  const Term& t = *GetParam();
  double most = 0.0;
  LoadInput<double> under_ceiling = busy_flight();
  under_ceiling.p_W_m.z = 2.9;
  for (const LoadInput<double>& in : {busy_flight(), ring_state(), under_ceiling}) {
    const Wrench with = wrench(in, only(t), acting(t)), without = wrench(in);
    most = std::max({most, (with.force - without.force).norm(), (with.torque - without.torque).norm()});
  }
  if (t.plain.reading && !t.plain.body) {
    EXPECT_EQ(most, 0.0) << "a reading has no load";
  } else {
    EXPECT_GT(most, 1e-5) << "N or N m";
  }
}

// At the bounds of the rates a line in time reaches nought after 50 s (thrust) and 100 s (mass).
TEST(ShareInTime, StaysAboveTwoPerCentWithExactDerivativesTwoMinutesAfterTheStartAtTheBoundsOfItsRates) {
  constexpr double kLate_s = 120.0, kStep_1_s = 1e-8;
  const auto at = [](double rate, double t_s) { return share_in_time(rate, t_s); };
  for (const double bound_1_s : {ThrustDrift::kParameters[0].min, RotorThrustDrift::kParameters[0].min, MassDrift::kParameters[0].min}) {
    for (double t_s = 0.0; t_s <= kLate_s; t_s += 0.5) {
      const ExtraDual share = share_in_time(ExtraDual::variable(bound_1_s, 0), ExtraDual(t_s));
      EXPECT_GT(share.a, kLeastShare) << bound_1_s << " 1/s, " << t_s << " s";
      EXPECT_NEAR(share.d[0], (at(bound_1_s + kStep_1_s, t_s) - at(bound_1_s - kStep_1_s, t_s)) / (2.0 * kStep_1_s), 5e-3)
          << t_s << " s (where line and hyperbola join the second derivative jumps)";
    }
    EXPECT_LT(at(bound_1_s, kLate_s), 2.0 * kLeastShare) << "beyond the line";
    EXPECT_GT(at(bound_1_s + kStep_1_s, kLate_s), at(bound_1_s, kLate_s)) << "a slope that leads back";
  }
  EXPECT_EQ(at(-0.02, 47.5), 1.0 - 0.02 * 47.5) << "a line as long as more than 4 % is left";
}

TEST(ShareInTime, AtTheBoundsOfTheRatesNoLoadIsInfiniteNorPullsDownTwoMinutesAfterTheStart) {
  const LoadInput<double> in = hover(paper_vehicle());
  const Wrench before = wrench(in);
  const std::vector<double> memory{120.0};
  for (const char* id : {"thrust_drift", "rotor_thrust_drift", "mass_drift"}) {
    const TermList list = only(id);
    std::vector<double> values;
    for (const TermParameter& p : find_term(id)->info.parameters) values.push_back(p.min);
    const LoadParameters<double> p = load_parameters(paper_vehicle());
    const LoadGeometry g = load_geometry(paper_vehicle());
    LoadState<double> s{in, p, g, {}, {}, {}, {}, {}, {}, {}};
    const TermSet<double> set(list, values.data(), memory.data());
    loads(s, &set);
    EXPECT_GT(s.force_B_N.z, 0.0) << id;
    EXPECT_LT(s.force_B_N.z, before.force.z() / kLeastShare) << id;
  }
}

std::vector<const Term*> terms() {
  std::vector<const Term*> all;
  for (const Term& t : all_terms()) all.push_back(&t);
  return all;
}
INSTANTIATE_TEST_SUITE_P(Terms, EveryTerm, testing::ValuesIn(terms()), [](const auto& i) { return std::string(i.param->info.id); });

}  // namespace
}  // namespace rotorloop::host
