#include "bench/sysid/diagnose/verdict.hpp"

namespace rotorloop::diagnose {

std::string_view name(DiagnosisVerdict v) {
  switch (v) {
    case DiagnosisVerdict::clean:
      return "clean";
    case DiagnosisVerdict::named:
      return "named";
    case DiagnosisVerdict::ambiguous:
      return "ambiguous";
    case DiagnosisVerdict::unexplained:
      return "unexplained";
    case DiagnosisVerdict::faulty:
      return "faulty";
    case DiagnosisVerdict::incomplete:
      return "incomplete";
  }
  return "";
}

}  // namespace rotorloop::diagnose
