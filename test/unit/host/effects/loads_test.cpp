// The model's loads: host/vehicle's equations when no term acts; terms vanish at their neutral values and obey the law they name.
#include "host/effects/loads.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "host/effects/advance.hpp"
#include "host/effects/term.hpp"
#include "host/vehicle/drag.hpp"
#include "host/vehicle/effect_catalogue.hpp"
#include "host/vehicle/thrust.hpp"
#include "test/unit/host/effects/flown.hpp"

namespace rotorloop::host {
namespace {

TEST(Loads, WithoutTermsAreTheEquationsOfTheVehicleModel) {
  const VehicleModel m = paper_vehicle();
  const LoadInput<double> in = general_flight();
  Eigen::Vector3d force = Eigen::Vector3d::Zero(), torque = Eigen::Vector3d::Zero();
  double sum = 0.0;
  for (int i = 0; i < kRotors; ++i) {
    const double omega = in.omega_rad_s[static_cast<std::size_t>(i)];
    const double t = solve_thrust(m.thrust, omega, 1.5, std::hypot(6.0, 2.0)).thrust_N;
    sum += t;
    torque += m.arm_m(i).cross(Eigen::Vector3d(0, 0, t));
    torque.z() += m.rotors[static_cast<std::size_t>(i)].reaction * m.c_q_N_m_s2 * omega * omega;
  }
  const Eigen::Vector3d v(6.0, -2.0, 1.5);
  force = rotor_drag_B_N(m.drag, sum, v) + airframe_drag_B_N(m.drag, v) + Eigen::Vector3d(0, 0, sum);
  const Wrench w = wrench(in);
  EXPECT_LT((w.force - force).norm(), 1e-9);
  EXPECT_LT((w.torque - torque).norm(), 1e-9);
}

TEST(Loads, DerivativesByMotionAndParametersAreThoseOfDifferences) {
  const VehicleModel m = paper_vehicle();
  const LoadGeometry g = load_geometry(m);
  const auto evaluate = [&](const std::array<double, 14>& at) {
    LoadInput<double> in = general_flight();
    in.v_B_m_s = {at[0], at[1], at[2]};
    in.rates_B_rad_s = {at[3], at[4], at[5]};
    const LoadParameters<double> p{at[6], at[7], at[8], at[9], at[10], at[11], at[12], at[13]};
    LoadState<double> s{in, p, g, {}, {}, {}, {}, {}, {}, {}};
    loads<double>(s, nullptr);
    return std::array<double, 6>{s.force_B_N.x, s.force_B_N.y, s.force_B_N.z, s.torque_B_N_m.x, s.torque_B_N_m.y, s.torque_B_N_m.z};
  };
  const LoadParameters<double> p = load_parameters(m);
  const std::array<double, 14> at{
      6.0,           -2.0, 1.5, 1.0, -2.0, 3.0, p.k1_N_s2, p.k2_N_s2_m, p.c_q_N_m_s2, p.com_x_m, p.com_y_m, p.c_dh_s_m, p.c_dxy_N_s2_m2,
      p.c_dz_N_s2_m2};
  using D = MotionDual;
  LoadInput<D> in;
  const LoadInput<double> plain = general_flight();
  in.v_B_m_s = {D::variable(at[0], 0), D::variable(at[1], 1), D::variable(at[2], 2)};
  in.rates_B_rad_s = {D::variable(at[3], 3), D::variable(at[4], 4), D::variable(at[5], 5)};
  for (std::size_t r = 0; r < 4; ++r) in.omega_rad_s[r] = D(plain.omega_rad_s[r]);
  const LoadParameters<D> q{D::variable(at[6], 6),   D::variable(at[7], 7),   D::variable(at[8], 8),   D::variable(at[9], 9),
                            D::variable(at[10], 10), D::variable(at[11], 11), D::variable(at[12], 12), D::variable(at[13], 13)};
  LoadState<D> s{in, q, g, {}, {}, {}, {}, {}, {}, {}};
  loads<D>(s, nullptr);
  const D* const rows[] = {&s.force_B_N.x, &s.force_B_N.y, &s.force_B_N.z, &s.torque_B_N_m.x, &s.torque_B_N_m.y, &s.torque_B_N_m.z};
  for (std::size_t j = 0; j < at.size(); ++j) {
    const double e = 1e-4 * std::max(std::fabs(at[j]), 1e-9);
    auto up = at, down = at;
    up[j] += e;
    down[j] -= e;
    const auto a = evaluate(up), b = evaluate(down);
    for (std::size_t i = 0; i < 6; ++i) {
      const double slope = (a[i] - b[i]) / (2 * e);
      EXPECT_NEAR(rows[i]->d[j], slope, 1e-5 * (1e-3 + std::fabs(slope))) << "row " << i << ", direction " << j;
    }
  }
}

TEST(Loads, TorqueOfTheAdvanceRatioHasTheDerivativesOfItsDifferencesAndEndsWithItsRange) {
  const AdvanceModel a{-1.5e-8, -0.1, 0.3};
  constexpr double kRadius_m = 0.0635, kStep = 1e-4;
  for (const double v_z : {-4.0, 2.0, 9.0}) {  // below, within and above the range at 900 rad/s
    ExtraDual omega(900.0), climb(v_z);
    omega.d[0] = climb.d[1] = 1.0;
    const ExtraDual q = advance_torque_N_m(a, kRadius_m, omega, climb);
    EXPECT_NEAR(q.d[0],
                (advance_torque_N_m(a, kRadius_m, 900.0 + kStep, v_z) - advance_torque_N_m(a, kRadius_m, 900.0 - kStep, v_z)) / (2 * kStep),
                1e-10);
    EXPECT_NEAR(q.d[1],
                (advance_torque_N_m(a, kRadius_m, 900.0, v_z + kStep) - advance_torque_N_m(a, kRadius_m, 900.0, v_z - kStep)) / (2 * kStep),
                1e-9);
    const double n = 900.0 / 6.283185307179586, J = std::min(std::max(v_z / (n * 2.0 * kRadius_m), a.j_low), a.j_high);
    EXPECT_NEAR(q.a, a.c_q2_N_m_s2 * J * J * 900.0 * 900.0, 1e-12);
  }
}

TEST(Loads, EveryTermChangesNothingAtItsNeutralValues) {
  for (const Term& t : all_terms()) {
    const Wrench with = wrench(general_flight(), only(t), neutral(t)), without = wrench(general_flight());
    EXPECT_LT((with.force - without.force).norm() + (with.torque - without.torque).norm(), 1e-12) << t.info.id;
  }
}

TEST(Loads, EveryTermHasTheParametersUnitsAndRangesThatTheCatalogueGivesToModels) {
  const auto spelt = [](std::string unit) {  // "kg m^2" in the catalogue, "kg m2" in code
    std::erase(unit, '^');
    return unit;
  };
  for (const Term& t : all_terms()) {
    const std::vector<CatalogueParameter>& entry = effect(t.info.id).model;
    ASSERT_EQ(entry.size(), t.info.parameters.size()) << t.info.id;
    for (std::size_t k = 0; k < entry.size(); ++k) {
      const TermParameter& p = t.info.parameters[k];
      EXPECT_EQ(entry[k].name, p.name) << t.info.id;
      EXPECT_EQ(spelt(entry[k].unit), p.unit) << t.info.id << "." << p.name;
      EXPECT_EQ(entry[k].min, p.min) << t.info.id << "." << p.name;
      EXPECT_EQ(entry[k].max, p.max) << t.info.id << "." << p.name;
      EXPECT_EQ(entry[k].neutral, p.neutral) << t.info.id << "." << p.name;
      EXPECT_GT(p.scale, 0.0) << t.info.id << "." << p.name;
      EXPECT_LE(p.scale, p.max - p.min) << t.info.id << "." << p.name;
    }
  }
}

TEST(Loads, ATermIsInAListOnceAndFindsItsOwnParameters) {
  TermList list;
  EXPECT_TRUE(list.add(*find_term("rotor_local_inflow")));
  EXPECT_TRUE(list.add(*find_term("rotor_inertia_reaction")));
  EXPECT_FALSE(list.add(*find_term("rotor_local_inflow")));
  EXPECT_EQ(list.parameters(), 2u);
  EXPECT_EQ(list.parameter(1).name, "J_r_kg_m2");
  EXPECT_EQ(list.term_of(1), 1u);
  EXPECT_EQ(find_term("no_such_effect"), nullptr);
}

TEST(RotorLocalInflow, OpposesRollAndPitchAndLeavesYawAlone) {
  const TermList list = only("rotor_local_inflow");
  for (int axis = 0; axis < 3; ++axis) {
    LoadInput<double> in = general_flight();
    in.v_B_m_s = {};
    in.omega_rad_s.fill(940.0);
    in.rates_B_rad_s = {axis == 0 ? 2.0 : 0.0, axis == 1 ? 2.0 : 0.0, axis == 2 ? 2.0 : 0.0};
    const Eigen::Vector3d change = wrench(in, list, {1.0}).torque - wrench(in).torque;
    if (axis < 2) {
      EXPECT_LT(change[axis], -1e-4) << "axis " << axis << ", N m at 2 rad/s";
    } else {
      EXPECT_LT(change.norm(), 5e-5);
    }
  }
}

TEST(RotorInertiaReaction, BodyAndRotorsTogetherKeepTheirAngularMomentumAboutYaw) {
  // What the rotors gain about +z the body loses: torque_z = -d/dt Σ J_r s_i ω_i, with s_i = -reaction.
  const double J = 9.4e-6;
  const LoadInput<double> in = general_flight();
  const Eigen::Vector3d change = wrench(in, only("rotor_inertia_reaction"), {J}).torque - wrench(in).torque;
  const double rotors_gain = J * (in.omega_dot_rad_s2[0] + in.omega_dot_rad_s2[1] - in.omega_dot_rad_s2[2] - in.omega_dot_rad_s2[3]);
  EXPECT_NEAR(change.z(), -rotors_gain, 1e-12);
}

TEST(Gyroscopic, BodyThatTurnsTiltsTheMomentumOfItsRotors) {
  const double J = 9.4e-6;
  const LoadInput<double> in = general_flight();
  const Eigen::Vector3d change = wrench(in, only("gyroscopic"), {J}).torque - wrench(in).torque;
  const double momentum = J * (in.omega_rad_s[0] + in.omega_rad_s[1] - in.omega_rad_s[2] - in.omega_rad_s[3]);
  const Eigen::Vector3d gyroscopic = -Eigen::Vector3d(1.0, -2.0, 3.0).cross(Eigen::Vector3d(0, 0, momentum));
  EXPECT_NEAR(change.x(), gyroscopic.x(), 1e-12);
  EXPECT_NEAR(change.y(), gyroscopic.y(), 1e-12);
}

}  // namespace
}  // namespace rotorloop::host
