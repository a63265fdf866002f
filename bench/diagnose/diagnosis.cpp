#include "bench/diagnose/diagnosis.hpp"

namespace rotorloop::bench {

std::string_view name(Verdict v) {
  switch (v) {
    case Verdict::clean:
      return "clean";
    case Verdict::named:
      return "named";
    case Verdict::ambiguous:
      return "ambiguous";
    case Verdict::unexplained:
      return "unexplained";
    case Verdict::faulty:
      return "faulty";
  }
  return "";
}

}  // namespace rotorloop::bench
