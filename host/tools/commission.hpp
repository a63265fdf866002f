// Commissioning an ESC of rotorloop from a tool: arms it, begins, watches and says how far it is, ends it whatever happens, and reports
// what was measured and what was not. An ESC ends it by itself when the tool falls silent.
#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "host/tools/parameters.hpp"

namespace rotorloop::tools {

struct CommissionOptions {
  bool spin = true;                 // false: at rest alone
  bool count = false;               // hold the speed until somebody has counted it: pole pairs and direction
  double speed_constant_rpm_V = 0;  // by the label; 0: not compared
  double bell_inertia_kg_m2 = 0;    // rotor without propeller; 0: not compared
};

struct CommissionedValue {
  std::string name;
  protocols::ParamValue before, value;
};
struct CommissionReport {
  std::uint8_t node = 0;
  std::string end;  // in the node's words: "done", "ended: …"
  std::vector<CommissionedValue> measured;
  std::vector<std::string> not_measured;  // left as entered
  bool done() const { return end == "done"; }
};

class Commission {
 public:
  // Listens through the tool; throws Error for values out of range. `said`: each message of the node meanwhile.
  Commission(ToolNode& tool, std::uint8_t node, const CommissionOptions& options, std::function<void(const std::string&)> said);

  // Throws Error: exit 2 when the node has no commissioning, 3 when it refuses (with its reason) or does not answer.
  void begin();
  // Sends what is due; false `go_on` ends it. Call until over(), polling the tool.
  void step(bool go_on);
  bool over() const { return over_; }
  const std::string& state() const { return state_; }  // in the node's words: "running: 40 %, resistance"
  bool wants_count() const;
  void counted(double rpm, bool reversed);  // while wants_count()
  // After over(): disarms, reads what has changed. Throws Error (exit 3) when the node does not answer.
  CommissionReport finish();

 private:
  void ask_state();
  void arm(bool armed);

  ToolNode& tool_;
  std::uint8_t node_;
  CommissionOptions options_;
  std::vector<NodeParameter> before_;
  std::string state_ = "running";
  std::int64_t next_arming_ns_ = 0, next_question_ns_ = 0, heard_ns_ = 0, stopped_ns_ = 0;
  bool asking_ = false, over_ = false, counted_ = false, begun_ = false;
};

nlohmann::ordered_json commission_json(const CommissionReport& report);

}  // namespace rotorloop::tools
