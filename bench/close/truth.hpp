// Afterwards, and only then: what the analyst said against what the plant had.
#pragma once
#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "host/vehicle/vehicle_file.hpp"

namespace rotorloop::closed_loop {

// right: named by its own id alone. in_class: its id, or what it shows as, is in an answer that names several. missed: in no answer.
enum class Told { right, in_class, missed };

struct HiddenEffect {
  std::string id;
  Told told = Told::missed;
  std::string answer;  // the effect that stands for it; empty: none
};

struct TruthValue {
  std::string what, unit;  // "kappa of rotor_wake_interference", "body.inertia.xx"
  double truth = 0.0, found = 0.0, u = 0.0;
  double errors_in_u() const { return u > 0 ? (found - truth) / u : 0.0; }
};

struct TruthComparison {
  std::vector<HiddenEffect> hidden;
  std::vector<std::string> wrong;  // answers that stand for nothing that was hidden
  std::vector<TruthValue> values;
  bool right() const;  // nothing missed, nothing wrong
};

// The body that flies by a vehicle file: as it says, with the payload and the shift of the centre of mass that its effects add.
struct FlyingBody {
  host::Quantity mass_kg;
  std::array<host::Quantity, 2> com_m;          // x and y in B from the file's origin
  std::array<host::Quantity, 3> inertia_kg_m2;  // xx, yy, zz about its centre of mass
};
FlyingBody flying_body(const host::VehicleFile& vehicle);

struct LoopPlan;
struct Findings;
// Effects by their ids, and their parameters where the names agree.
TruthComparison compare_effects(const LoopPlan& plan, const Findings& findings);

// Reads a finished loop's run folder, adds the values of the vehicle file against the plant (mass properties with payload), writes
// truth.json.
TruthComparison tell_truth(const std::filesystem::path& run);

std::string truth_json(const TruthComparison& c);
TruthComparison read_truth(const std::filesystem::path& truth_json);
std::string truth_text(const TruthComparison& c);

}  // namespace rotorloop::closed_loop
