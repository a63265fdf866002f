// Which rotor, and what kind of defect, from motor commands alone: in hover the mean command of each rotor says what the controller had
// to ask of it, and its change against flights of the same vehicle without the defect has a pattern for each kind. Four figures and a sway
// per flight: they identify a rotor well and distinguish few kinds; what they cannot decide comes out as a class.
#pragma once
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "bench/studies/hover_reference.hpp"
#include "bench/studies/hover_shares.hpp"
#include "bench/sysid/diagnose/verdict.hpp"
#include "host/vehicle/model.hpp"

namespace rotorloop::studies {

struct HoverHypothesis {
  std::vector<std::string> ids;  // effects/catalogue.toml; with the rotor, "weak_rotor 2"
  int rotor = 0;                 // of that rotor alone; 0: of several or of none
  std::vector<diagnose::NamedValue> parameters;
  double misfit = 0.0;       // what is left, in variances of a flight, per degree of freedom
  int degrees = 0;           // unknowns
  std::string ruled_out_by;  // empty: it explains the change
};

struct HoverDiagnosis {
  HoverShare share;
  std::array<double, 4> change{};           // of each rotor's demand, relative to the reference
  std::array<double, 4> u{};                // of each change: scatter of the reference flights, and of their mean
  std::array<double, 4> seen_from{};        // the least rise that is called a defect
  std::vector<HoverHypothesis> hypotheses;  // fewest unknowns first, best first
  diagnose::DiagnosisVerdict verdict = diagnose::DiagnosisVerdict::clean;  // faulty: the reference is of another vehicle
  std::string refused;             // why the reference says nothing about this flight; empty: it does
  std::vector<std::string> named;  // one: named; several: a class
  std::vector<int> rotors;         // 1 to 4, most first: asked for more, and indistinguishable by how much
  std::optional<int> rotor;        // when it is one
  std::vector<std::string> remarks;
};

// `reference`: at least two flights of the same vehicle without the defect. Throws Error (data_quality) with fewer, without hover, or
// when they are of two vehicles.
HoverDiagnosis diagnose_hover(const log::FlightRecord& flight, const std::vector<log::FlightRecord>& reference,
                              const host::VehicleModel& vehicle);
HoverDiagnosis judge_hover(const HoverShare& flight, const HoverReference& reference, const host::VehicleModel& vehicle);

std::string hover_text(const HoverDiagnosis& d);

}  // namespace rotorloop::studies
