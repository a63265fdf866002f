// What drives the model beside its state, at any time: rotor speeds, interpolated from measured ones or made from motor commands and
// battery voltage by a first-order motor, and the memory of terms. Knows its derivatives by its own parameters (delay; gain, offset,
// voltage exponent, lag; those of dynamic_term_input.hpp).
#pragma once
#include <array>
#include <vector>

#include "bench/sysid/estimate/model/dynamic_term_input.hpp"
#include "bench/sysid/estimate/model/parameters.hpp"
#include "bench/sysid/estimate/model/rotor_input_sample.hpp"
#include "bench/sysid/log/flight_record.hpp"

namespace rotorloop::estimate {

class RotorInput {
 public:
  // From measured speeds when the record has them, else from commands. ω̇ is the slope of a straight line through the samples of
  // `rate_window_s` around each sample; ω, where two thirds of the window hold seven or more, that of a parabola through these. A rotor's
  // missing measurements are bridged by straight lines up to `longest_gap_s`.
  // Throws Error (data_quality) when the record has neither stream.
  RotorInput(const log::FlightRecord& record, double rate_window_s = 0.012, double longest_gap_s = 0.05);

  bool from_commands() const { return from_commands_; }
  // Measurements cover [from, to] without a gap longer than `longest_gap_s`.
  bool covers(double from_s, double to_s) const;
  double first_s() const { return t_s_.front(); }
  double last_s() const { return t_s_.back(); }

  // Must be called before at() whenever the values change: with commands it runs the motor model over the flight.
  // `derivatives`: of the terms' memory; what asks for no slopes by their numbers can do without.
  void prepare(const ModelValues& values, bool derivatives = true);
  // `hint`: the caller's cursor, any value; makes neighbouring times cheap. Outside the measurements the nearest one is held.
  RotorInputSample at(double t_s, std::size_t& hint, bool derivatives) const;
  // Mean over [from, to] by Simpson's rule in `parts` parts; battery and memory as they are in the middle.
  RotorInputSample mean(double from_s, double to_s, int parts, std::size_t& hint, bool derivatives) const;

  // The motion along which dynamic terms are propagated; to be followed by prepare().
  void follow(std::shared_ptr<const Motion> motion) { memory_.follow(std::move(motion)); }
  bool follows() const { return memory_.follows(); }

 private:
  void smooth();
  void slopes(double window_s);
  void run_motors(const ModelValues& values);
  std::size_t interval(double t_s, std::size_t hint) const;

  bool from_commands_ = false;
  double delay_s_ = 0.0;
  double rate_window_s_ = 0.0;
  std::vector<double> t_s_;
  std::vector<bool> gap_after_;
  std::vector<std::array<double, 4>> command_;  // with commands: u
  std::vector<double> battery_V_;               // at each sample; empty without the stream
  std::vector<std::array<double, 4>> omega_, omega_dot_;
  std::array<std::vector<std::array<double, 4>>, 4> by_, dot_by_;  // with commands: by gain, offset, exponent, lag
  DynamicTermInput memory_;
};

}  // namespace rotorloop::estimate
