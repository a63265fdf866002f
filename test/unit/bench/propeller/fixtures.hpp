// Small files in the formats of UIUC, APC and XFLR5, and the means to spoil them.
#pragma once
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "host/base/error.hpp"

namespace rotorloop::propeller::fixtures {

// What a user reads; every input error ends the command with exit code 2.
inline std::string message(const std::function<void()>& f) {
  try {
    f();
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), ExitCode::usage);
    EXPECT_FALSE(e.text().remedy.empty()) << e.what();
    return e.what();
  }
  return "(no error)";
}
inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}
// As files from Windows come: carriage returns, trailing blanks.
inline std::string with_carriage_returns(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '\n' ? std::string("  \r\n") : std::string(1, c);
  return out;
}

inline const std::string kGeometry =
    "r/R   c/R     beta\n0.15  0.120  41.4\n0.30  0.159  36.4\n0.50  0.178  25.8\n0.75  0.180  18.9\n1.00  0.022  15.5\n";
inline const std::string kStatic = "RPM   CT    CP\n1500  0.118 0.097\n3000  0.122 0.093\n4500  0.125 0.090\n6000  0.126 0.089\n";
inline const std::string kSweep =
    "J     CT    CP    eta\n0.2  0.110  0.085  0.2588\n0.4  0.090  0.075  0.4800\n0.6  0.060  0.058  0.6207\n0.9 -0.004  0.012 -0.3000\n";

inline std::string mould_row(double station_in, double chord_in, double twist_deg) {
  return "      " + std::to_string(station_in) + " " + std::to_string(chord_in) + " 4.0 4.2 4.0 0.25 0.15 " + std::to_string(twist_deg) +
         " 0.05 0.02 0.08 0.10 -0.01\n";
}
inline const std::string kMould =
    "4.2x4    (42x4.dat)\n\n"
    "      STATION     CHORD       PITCH       PITCH        PITCH       SWEEP    THICKNESS      TWIST      MAX-THICK  CROSS-SECTION ZHIGH "
    " CGY  CGZ\n"
    "       (IN)       (IN)       (QUOTED)    (LE-TE)     (PRATHER)      (IN)     RATIO         (DEG)       (IN)      (IN**2)      (IN)    "
    "(IN)  (IN)\n\n" +
    mould_row(0.50, 0.38, 43.7) + mould_row(0.60, 0.38, 43.1) + mould_row(0.60, 0.38, 43.1) + mould_row(1.00, 0.40, 34.0) +
    mould_row(1.50, 0.37, 24.4) + mould_row(2.00, 0.19, 17.0) + mould_row(2.09, 0.01, 13.8) +
    "\n\n RADIUS:  2.09    PROPELLER RADIUS (IN)\n HUBTRA:  0.50    HUB TRANSITION (IN)\n BLADES:  2       NUMBER OF BLADES\n\n"
    " MOMENT OF INERTIA (Kg-M**2) =     0.000042\n\n"
    " AIRFOIL1:  1.00, E63     (Transition Start, Airfoil 1)\n AIRFOIL2:  2.00, APC12     (Transition End, Airfoil 2)\n";

// A thin section: lift 2 pi alpha / (1 + 0.1) up to 10 degrees, flat beyond.
inline std::string polar_text(const std::string& airfoil = "NACA 0000", double reynolds_million = 0.030, double from_deg = -15.0,
                              double to_deg = 15.0) {
  std::string text = "xflr5 v6.61\n\n Calculated polar for: " + airfoil +
                     "\n\n 1 1 Reynolds number fixed          Mach number fixed\n\n xtrf =   1.000 (top)        1.000 (bottom)\n Mach =   "
                     "0.000     Re =     " +
                     std::to_string(reynolds_million) +
                     " e 6     Ncrit =   6.000\n\n  alpha     CL        CD       CDp       Cm    Top Xtr Bot Xtr   Cpmin    Chinge    XCp\n"
                     " ------- -------- --------- --------- -------- ------- ------- -------- --------- ---------\n";
  for (double a = from_deg; a <= to_deg; a += 0.5) {
    const double limited = std::min(std::max(a, -10.0), 10.0);
    text += " " + std::to_string(a) + " " + std::to_string(0.1 * limited) + " " + std::to_string(0.02 + 0.0005 * a * a) +
            " 0.01 0.0 1.0 1.0 -1.0 0.0 0.0 0.0 0.25\n";
  }
  return text;
}

}  // namespace rotorloop::propeller::fixtures
