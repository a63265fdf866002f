// What stands on the virtual stand: the firmware core with its node and drive, a blade-element rotor in axial wind, a bench supply.
#pragma once
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "firmware/core/node/esc_node.hpp"
#include "host/bus/can_bus.hpp"
#include "sim/drive/battery.hpp"
#include "sim/esc/native_esc.hpp"
#include "sim/esc/noded_esc.hpp"
#include "sim/plant/assemble.hpp"

namespace rotorloop::virtual_stand {

struct StandRotorConfig {
  std::filesystem::path plant;      // drive and propeller are those of its first rotor
  std::optional<sim::Blade> blade;  // on the motor in place of the plant's
  double density_kg_m3 = 1.2;
  double axial_wind_m_s = 0.0;  // through the rotor as in climb
  double thrust_lost = 0.0;     // share that what stands behind the rotor takes in configuration B
  int esc_index = 0;
  int pole_pairs = 0;        // that the ESC is set to; 0: those of the motor
  double speed_error = 0.0;  // relative, of the ESC's clock: what it reports over what is
  std::uint64_t seed = 1;    // board spread and noise
};

class StandRotor {
 public:
  static constexpr std::int64_t kPollNs = 250'000;  // six periods of 24 kHz

  StandRotor(const StandRotorConfig& config, CanBus& port);
  ~StandRotor();
  // 250 us: one poll of the node and six periods of the current loop.
  void advance();
  void set_configuration(char configuration) { configuration_ = configuration; }

  double omega_rad_s() const;  // true
  double thrust_N() const { return thrust_N_; }
  double reaction_N_m() const { return reaction_N_m_; }  // on the mount: of the air, and of the rotor's own acceleration
  double supply_V() const { return supply_.voltage_V(); }
  double supply_A() const { return supply_A_; }
  double density_kg_m3() const { return config_.density_kg_m3; }
  // Truth at a speed, still air or the wind of the configuration, at the stand's density; configuration A.
  double c_t_N_s2(double omega_rad_s) const { return table(c_t_, omega_rad_s); }
  double c_q_N_m_s2(double omega_rad_s) const { return table(c_q_, omega_rad_s); }
  double inertia_kg_m2() const { return inertia_kg_m2_; }
  double resistance_ohm() const { return resistance_ohm_; }  // one phase, with the switches
  double speed_constant_rpm_V() const { return speed_constant_rpm_V_; }
  double diameter_m() const { return diameter_m_; }

 private:
  using Esc = sim::NodedEsc<sim::NativeEsc, firmware::EscNode>;
  double table(const std::vector<double>& values, double omega_rad_s) const;
  void couple();

  StandRotorConfig config_;
  sim::PlantFile plant_;
  std::shared_ptr<const sim::Rotor> rotor_;
  sim::Battery supply_;
  std::unique_ptr<Esc> esc_;
  std::vector<double> c_t_, c_q_;  // over speed
  double inertia_kg_m2_ = 0.0, diameter_m_ = 0.0, resistance_ohm_ = 0.0, speed_constant_rpm_V_ = 0.0, supply_A_ = 0.0, thrust_N_ = 0.0,
         reaction_N_m_ = 0.0;
  char configuration_ = 'A';
  std::uint64_t polls_ = 0;
};

}  // namespace rotorloop::virtual_stand
