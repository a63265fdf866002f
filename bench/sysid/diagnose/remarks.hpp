// What a diagnosis says in words beside its figures.
#pragma once
#include <array>
#include <string>
#include <vector>

#include "bench/sysid/diagnose/diagnose_options.hpp"
#include "bench/sysid/diagnose/diagnosis.hpp"
#include "bench/sysid/diagnose/ranking/shortlist.hpp"

namespace rotorloop::diagnose {

// What was not judged may be what is missing.
void note_unfinished(const std::vector<RefitCandidate>& ranked, Diagnosis& d);

// A prior that is wrong is no effect that the model lacks, and yet changes what the model predicts.
void note_contradictions(const identify::Identification& model, Diagnosis& d);

// A gate that stands lower than it was meant to, or not at all, is no secret.
void note_placebos(const Criteria& criteria, Diagnosis& d);

// Which streams the fit read: what could be seen depends on them.
std::string measurements_used(const identify::Identification& r);

// A load beside the body shares a scale with all that the vehicle file weighs.
std::string mass_beside_body(const std::string& id, double load_kg, double body_kg);

// Of each effect its size in words and what to do about it; rotors are named by their place on the vehicle, and as the logs call them
// (FlightsToDiagnose::rotor_columns).
void add_words(const estimate::ModelValues& vehicle, const std::array<std::string, 4>& rotor_columns, const Criteria& criteria,
               Diagnosis& d);

// What the checks took out of the logs: a fault of a sensor or stream, or no fault. Notes took nothing out.
void report_checks(const FlightsToDiagnose& flights, Diagnosis& d);

}  // namespace rotorloop::diagnose
