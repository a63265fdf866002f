// Which rotor, and what kind of defect, from motor commands alone: in hover the mean command of each rotor says what the controller
// had to ask of it, and its change against flights of the same vehicle without the defect has a pattern for each kind. Four figures
// per flight: they identify a rotor well, a kind less well; what they cannot decide comes
// out as a class.
#pragma once
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "bench/diagnose/verdict.hpp"
#include "bench/log/flight_record.hpp"
#include "host/vehicle/model.hpp"

namespace rotorloop::studies {

// What the commands of a log stand for. thrust: the firmware makes up for the battery, a command asks for thrust (Crazyflie firmware
// with battery compensation); duty: share of the battery voltage.
enum class CommandMeaning { thrust, duty };

struct HoverShare {
  std::string flight;
  std::array<double, 4> demand{};  // mean thrust demand of our rotors 1 to 4, in units of full command
  double battery_V = 0.0;
  double saturated = 0.0;     // share of the samples in which a rotor is at full command
  double yaw_sway_rad = 0.0;  // rms of yaw between 0.2 and 0.8 Hz in hover; 0 without an extra "yaw[rad]"
  std::size_t samples = 0;
};

// Samples above four fifths of the flight's usual height that climb or sink by less than 0.15 m/s. Empty when there are fewer than 200.
std::optional<HoverShare> hover_share(const log::FlightRecord& flight, CommandMeaning meaning);

// Of reference flights at several battery voltages: the meaning that leaves less scatter in their total.
CommandMeaning command_meaning(const std::vector<log::FlightRecord>& reference);

struct HoverHypothesis {
  std::vector<std::string> ids;  // effects/catalogue.toml; with the rotor, "weak_rotor 2"
  std::vector<diagnose::NamedValue> parameters;
  double misfit = 0.0;       // what is left, in variances of a flight, per degree of freedom
  int degrees = 0;           // unknowns
  std::string ruled_out_by;  // empty: it explains the change
};

struct HoverDiagnosis {
  HoverShare share;
  std::array<double, 4> change{};           // of each rotor's demand, relative to the reference
  double u = 0.0;                           // of a change: scatter of the reference flights, and of their mean
  std::vector<HoverHypothesis> hypotheses;  // fewest unknowns first, best first
  diagnose::DiagnosisVerdict verdict = diagnose::DiagnosisVerdict::clean;
  std::vector<std::string> named;  // one: named; several: a class
  std::optional<int> rotor;        // the one whose demand changed most, 1 to 4, when any change is beyond 3.3 u
  std::vector<std::string> remarks;
};

// `reference`: at least two flights of the same vehicle without the defect. Throws Error (data_quality) with fewer, or without hover.
HoverDiagnosis diagnose_hover(const log::FlightRecord& flight, const std::vector<log::FlightRecord>& reference, const host::VehicleModel& vehicle);

std::string hover_text(const HoverDiagnosis& d);

}  // namespace rotorloop::studies
