// The air takes time to follow a rotor: all its loads are a first-order lag behind their steady value, with time constant tau.
// Thrust, in-plane force, hub moment and aerodynamic torque lag alike; the reaction to the rotor's own acceleration does not, which is
// what distinguishes this from a late speed signal. Theory gives 0.85 R / (4 v_i), some 2 ms for a 5-inch propeller; identification of
// whole vehicles has found up to 30 ms where the drive was not modelled. Source: Carpenter & Fridovich, NACA TN-3044, 1953.
#include <array>

#include "host/base/elementary.hpp"
#include "sim/airframe/airframe.hpp"
#include "sim/effects/rotor/rotor_list.hpp"

namespace rotorloop::sim {
namespace {

class ThrustLag final : public Effect {
 public:
  explicit ThrustLag(const EffectValues& v) : tau_s_(v[0]) {}

  void rotor_loads(const RotorSite& s, RotorLoads& loads) override {
    if (tau_s_ <= 0.0) return;
    State& x = state_[s.index];
    const double now_s = s.body->time_s;
    // Exact for a steady load over the step; the first call starts from the steady value.
    const double keep = x.started ? exp_exact(-(now_s - x.time_s) / tau_s_) : 0.0;
    x.force_R_N = loads.force_R_N + keep * (x.force_R_N - loads.force_R_N);
    x.moment_R_N_m = loads.moment_R_N_m + keep * (x.moment_R_N_m - loads.moment_R_N_m);
    x.shaft_torque_N_m = loads.shaft_torque_N_m + keep * (x.shaft_torque_N_m - loads.shaft_torque_N_m);
    x.time_s = now_s;
    x.started = true;
    loads.force_R_N = x.force_R_N;
    loads.moment_R_N_m = x.moment_R_N_m;
    loads.shaft_torque_N_m = x.shaft_torque_N_m;
  }

 private:
  struct State {
    bool started = false;
    double time_s = 0.0;
    Eigen::Vector3d force_R_N = Eigen::Vector3d::Zero();
    Eigen::Vector3d moment_R_N_m = Eigen::Vector3d::Zero();
    double shaft_torque_N_m = 0.0;
  };
  double tau_s_;
  std::array<State, kAirframeRotors> state_{};
};

}  // namespace

const EffectInfo kThrustLag{.id = "thrust_lag", .parameter = {"tau_s", "s", 0.0, 0.05, 0.0}, .options = {}, .make = make_effect<ThrustLag>};

}  // namespace rotorloop::sim
