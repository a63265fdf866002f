// Whether the instruments of a stand can be trusted while its motor turns. The limits of a stand file do not see a reading that stands
// still, a decimal point that is set wrong or two channels that are exchanged: all of them lie within the limits. Each hold is compared
// with the holds before it, with the ESC's own readings and with what such a propeller gives.
#pragma once
#include <array>
#include <string>

#include "bench/stand/instruments/stand_setup.hpp"
#include "bench/stand/run/recorder.hpp"

namespace rotorloop::stand_run {

class InstrumentCheck {
 public:
  // The setup must outlive it. `top_rad_s`: highest speed of the plan. `in_wind`: thrust and torque of a propeller in a wind tunnel may be
  // anything below those in still air.
  InstrumentCheck(const modbus::StandSetup& setup, double top_rad_s, bool in_wind)
      : setup_(setup), top_rad_s_(top_rad_s), in_wind_(in_wind) {}
  // Holds in their order. What cannot be trusted, with channel, values and what is likely; empty: nothing.
  std::string hold(const StepMeans& step);

 private:
  struct Still {
    double value = 0.0, slowest_rad_s = 0.0, fastest_rad_s = 0.0;  // of holds in which the channel showed this and nothing else
    double spread = 0.0;                                           // the least within a hold so far, not 0; 0: it never moved
    bool has = false;
  };
  std::string stands_still(const StepMeans& step);
  std::string of_propeller(const StepMeans& step) const;
  std::string of_supply(const StepMeans& step) const;

  const modbus::StandSetup& setup_;
  double top_rad_s_;
  bool in_wind_;
  double zero_N_ = 0.0, zero_N_m_ = 0.0;
  std::array<Still, stand::kColumns> still_{};
};

}  // namespace rotorloop::stand_run
