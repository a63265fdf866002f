// Which polars stand for a propeller's sections, by rule.
#pragma once
#include "bench/propeller/fit/propeller_files.hpp"

namespace rotorloop::propeller {

// Without a mould: NACA 4410, the section of the shipped blade (decision 0023). With one: by the names that it has, where
//   APC12 is NACA 4412 (the mould files say so); CLARK-Y, scaled to the thickness at 0.75 R, is whichever of Clark-Y and NACA 4412 has the
//   nearer camber, as scaling scales it too; E63 is Eppler 63, but not at 0.75 R where its polars have a hole: then the mould's other
//   section.
// `inputs.section`: one for the whole blade in place of all that.
SectionChoice section_by_rule(const PropellerFiles& files, const PropellerInputs& inputs);

}  // namespace rotorloop::propeller
