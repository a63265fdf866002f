// Afterwards, and only then: what the diagnosis named, and how large, against what the plant had. Names and sizes are judged apart.
#pragma once
#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "host/vehicle/vehicle_file.hpp"

namespace rotorloop::closed_loop {

// right: named by its own id alone. in_class: one of its names is in an answer that names several, or is not its own. missed: in no answer.
enum class NameResult { right, in_class, missed };

// not_compared: the answer gives no value for a parameter of the hidden effect (it names another of its class).
enum class Size { right, wrong, not_compared };

struct HiddenEffect {
  std::string id;
  NameResult name = NameResult::missed;
  std::string answer;  // the effect that stands for it; empty: none
  Size size = Size::not_compared;
};

struct TruthValue {
  std::string what, unit;  // "kappa of rotor_wake_interference", "body.inertia.xx"
  double truth = 0.0, found = 0.0, u = 0.0;
  double errors_in_u() const { return u > 0 ? (found - truth) / u : 0.0; }
  // What an error may be though the stated uncertainty is smaller: 1 % of the true size, the reproducibility of scales, pendulum and
  // thrust stand; 0.1 mm for a place of the centre of mass, which has no size. (1 % of the mass moves a climb by 7 mm.)
  double tolerance() const;
  // Within three standard errors, as 99.7 % of honest ones are, or within the tolerance.
  bool right() const;
};

struct TruthComparison {
  std::vector<HiddenEffect> hidden;
  std::vector<std::string> wrong;  // answers that stand for nothing that was hidden
  std::vector<TruthValue> values;
  bool names_right() const;  // nothing missed, nothing wrong
  bool sizes_right() const;  // every value compared
  bool right() const { return names_right() && sizes_right(); }
};

// The body that flies by a vehicle file: as it says, with the payload and the shift of the centre of mass that its effects add.
struct FlyingBody {
  host::Quantity mass_kg;
  std::array<host::Quantity, 2> com_m;          // x and y in B from the file's origin
  std::array<host::Quantity, 3> inertia_kg_m2;  // xx, yy, zz about its centre of mass
};
FlyingBody flying_body(const host::VehicleFile& vehicle);

struct LoopPlan;
struct InjectedEffect;
struct Findings;
// Every name that an answer may give a hidden effect: its own; those that the catalogue lists as indistinguishable from it in flight
// (`twins`); and what the loop file says that it `shows_as`, for effects that the catalogue does not know.
std::vector<std::string> names_of(const InjectedEffect& hidden);

// Effects by their names, and their parameters where the names agree.
TruthComparison compare_effects(const LoopPlan& plan, const Findings& findings);

// Reads a finished loop's run folder, adds the values of the vehicle file against the plant (mass properties with payload), writes
// truth.json.
TruthComparison compare_with_truth(const std::filesystem::path& run);

std::string truth_json(const TruthComparison& c);
TruthComparison read_truth(const std::filesystem::path& truth_json);
std::string truth_text(const TruthComparison& c);

}  // namespace rotorloop::closed_loop
