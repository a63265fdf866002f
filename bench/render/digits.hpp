// Numbers with the digits that their uncertainty allows: two significant ones of u, and the value to the same decimal place. More would
// claim what nobody knows, fewer would throw away what was measured. Plain text; document.hpp typesets it.
#pragma once
#include <string>

namespace rotorloop::render {

struct MeasuredText {
  std::string value;  // "0.01750", "4.327e-08", "12350"
  std::string u;      // "0.00037", "1.2e-10", "340"; empty when u is not above 0: the value then has four digits
};
MeasuredText measured(double value, double u);

// "4.33 ± 0.12"; the value alone where there is no u.
std::string measured_text(double value, double u);

}  // namespace rotorloop::render
