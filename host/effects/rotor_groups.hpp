// Terms with one number for each rotor whose common part is a number that the model has already (`common_part` of its traits): four thrusts
// that are all a little less are a smaller k_1. The two are indistinguishable in any flight, so only the differences between rotors belong
// to the term. Whoever fits, tests or reports such a term asks here.
#pragma once
#include <string_view>

namespace rotorloop::host {

// The numbers of the model that hold the common part of this term's numbers, in words; empty where every number is its own.
std::string_view common_part(std::string_view term_id);

}  // namespace rotorloop::host
