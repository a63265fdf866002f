// Verdicts as JUnit XML, the form that build servers show: a case for each flight and limit of a run, or for each thing that a fit must
// hold. Holds no times, so that equal results give equal bytes.
#pragma once
#include <string>
#include <vector>

namespace rotorloop::cli {

enum class JunitEnd { passed, failed, error, skipped };  // error: could not be judged

struct JunitCase {
  std::string group, name;
  JunitEnd end = JunitEnd::passed;
  std::string message = {};  // why, where it did not pass
};

// One suite. Text is escaped here; characters that XML 1.0 does not know become '?'.
std::string junit_xml(const std::string& suite, const std::vector<JunitCase>& cases);

}  // namespace rotorloop::cli
