// Commissioning: measures the motor and the bridge that it hangs on. While active() its on_sample() takes the place of the motor control's
// in the sample interrupt; it drives only as long as the main loop renews the order, and leaves the bridge off whenever it ends.
//
//   if (commissioning.active()) commissioning.on_sample(board); else motor.on_sample(board);    interrupt
//   commissioning.set_order(…); commissioning.result();                                        main loop, every poll
//
// Fits are solved and configurations made in the interrupt itself, with the bridge off: a late interrupt then harms nothing.
#pragma once
#include "firmware/board/board.hpp"
#include "firmware/core/commission/procedure.hpp"

namespace rotorloop::firmware {

template <Board B>
class Commissioning : public CommissioningProcedure {
 public:
  explicit Commissioning(const Parameters& parameters) { set_parameters(parameters); }

  // As entered, with their limits; only while not active(). Takes effect with the next order.
  void set_parameters(const Parameters& parameters) {
    entered_ = parameters;
    config_ = configure<B>(parameters);
    board_ = {B::kDiodeDrop_V, B::kSwitchResistance_ohm, static_cast<float>(B::kPwm_Hz), magnitude(B::kCurrent_A_per_count)};
  }

  // The sample interrupt.
  void on_sample(B& board) {
    CommissioningVariables& v = v_;
    const AdcCounts adc = board.adc();
    v.ended = v.active;
    v.ended_driven = v.active_driven;
    v.active = v.pending;
    v.active_driven = v.pending_driven;
    const float bus_V = accept(v.bus, static_cast<float>(adc.bus) * B::kBus_V_per_count, config_.bus_jump_V);
    v.bus_V += config_.bus_filter * (bus_V - v.bus_V);
    CommissioningEnd fault = sense(adc, bus_V);
    v.duty_V = v.ended_driven ? bus_V * v.ended.duty : Stator{};
    if (v.slot == 0) {
      take_order();
      const CommissioningEnd ended = follow_order();
      if (fault == CommissioningEnd::none) fault = ended;
      if (v.temperature_K == 0.0f || (adc.temperature > 8 && adc.temperature < 4087))
        v.temperature_K =
            accept(v.temperature, static_cast<float>(adc.temperature) * B::kTemperature_K_per_count + B::kTemperatureZero_K, 5.0f);
      if (fault == CommissioningEnd::none && running()) fault = watch();
    }
    if (fault != CommissioningEnd::none && running()) finish(fault);
    if (running()) advance();
    if (v.wants_configuration) reconfigure();

    if (drives()) {
      v.pending = modulate(config_.modulator, v.command_V, {}, bus_V, 0.0f);
      board.set_compare(v.pending.compare);
      if (!v.pending_driven) board.bridge_on();
      v.pending_driven = true;
    } else {
      board.bridge_off();
      v.pending = {};
      v.pending_driven = v.active_driven = false;
    }
    v.slot = v.slot + 1 == kSlots ? 0 : v.slot + 1;
    if (v.slot == 0) publish();
  }

 private:
  CommissioningEnd sense(const AdcCounts& adc, float bus_V) {
    CommissioningVariables& v = v_;
    Sensed sensed = sense_currents(config_.sense, v.sense, adc, v.ended.compare);
    CommissioningEnd end = CommissioningEnd::none;
    if (drives()) {
      disturb_zero(config_.sense, v.sense);
      const Sample sample = v.ended_driven ? check_sample(config_.check, v.check, sensed, v.current_A, bus_V) : Sample::good;
      const Fault fast = sample == Sample::lost ? Fault::sensor : check_fast(config_.protection, sensed, bus_V);
      end = fast == Fault::none          ? CommissioningEnd::none
            : fast == Fault::overcurrent ? CommissioningEnd::overcurrent
            : fast == Fault::overvoltage ? CommissioningEnd::overvoltage
                                         : CommissioningEnd::current_sensor;
    } else {
      calibrate_zero(config_.sense, v.sense, adc);
    }
    v.last_A = v.current_A;
    v.current_A = sensed.current_A;
    return end;
  }

  void reconfigure() {
    config_ = configure<B>(found_);
    v_.wants_configuration = false;
  }
};

}  // namespace rotorloop::firmware
