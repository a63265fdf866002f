// From the [[effect]]s of a vehicle file to the terms that the controller flies with. Hosts only.
#pragma once
#include <string>
#include <vector>

#include "host/effects/vehicle_terms.hpp"
#include "host/vehicle/vehicle_file.hpp"

namespace rotorloop::host {

struct FileTerms {
  VehicleTerms terms;
  std::vector<std::string> not_flown;  // effects of the file that are no load: the library has no term, or one of a sensor only
};

// In the order of all_terms(). A parameter that the file leaves out has its neutral value; a dynamic term (memory.hpp) starts, and
// stays, at rest. Throws Error for a parameter that the term does not have or that
// lies outside its bounds, and for more terms than a controller carries.
FileTerms terms_of(const VehicleFile& vehicle, const std::string& name_for_errors);

}  // namespace rotorloop::host
