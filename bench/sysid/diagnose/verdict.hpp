// What a diagnosis may come to, of flights, stands or motor commands alike; and a value with its uncertainty.
#pragma once
#include <string>
#include <string_view>

namespace rotorloop::diagnose {

// clean: nothing beyond the model was found. named: every effect added stands alone. ambiguous: at least one is a class, whose
// members are indistinguishable in these flights. unexplained: the residual is real, and no effect of the library was added. What is left
// after named effects leaves their verdict as it is and stands beside it (Diagnosis::remains). faulty: a sensor or the log is at fault, and
// no physics was fitted to it. incomplete: stopped before its end; what was found until then stands.
enum class DiagnosisVerdict { clean, named, ambiguous, unexplained, faulty, incomplete };
std::string_view name(DiagnosisVerdict v);

struct NamedValue {
  std::string name, unit;
  double value = 0.0, u = 0.0;  // u: the larger of the classical and the block-robust standard error
};

}  // namespace rotorloop::diagnose
