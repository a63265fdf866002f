// Parameters of a node over the bus: all of them, one by name, set with the checks that the node would make in silence.
#pragma once
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "host/tools/tool_node.hpp"

namespace rotorloop::tools {

struct NodeParameter {
  std::string name;
  protocols::ParamValue value, default_value;
  protocols::NumericValue min, max;
};

// In the order of the node; none at all for a node that has none. Throws Error (exit 3) when the node does not answer.
std::vector<NodeParameter> read_parameters(ToolNode& tool, std::uint8_t node);
// None when the node has no parameter of this name. Throws Error (exit 3) when it does not answer.
std::optional<NodeParameter> find_parameter(ToolNode& tool, std::uint8_t node, const std::string& name);
// Throws Error: usage for a name that the node does not have, device for no answer.
NodeParameter read_parameter(ToolNode& tool, std::uint8_t node, const std::string& name);

// "8", "0.35", "true", "text" as the parameter's type and within its limits; throws Error (exit 2) with the limits. `where`: option or
// file:line.
protocols::ParamValue parse_value(const NodeParameter& parameter, const std::string& text, const std::string& where);
// Sets and reads back. Throws Error (exit 3) when the node keeps another value: it refuses, most often as its motor runs.
NodeParameter set_parameter(ToolNode& tool, std::uint8_t node, const NodeParameter& parameter, const protocols::ParamValue& value);

enum class ParameterOrder : std::uint8_t { save, erase };
// Throws Error (exit 3) when the node refuses or does not answer.
void execute(ToolNode& tool, std::uint8_t node, ParameterOrder order);

std::string value_text(const protocols::ParamValue& value);    // "8", "0.35", "true", "\"text\"", "-"
std::string limit_text(const protocols::NumericValue& value);  // "0.35", "-"
nlohmann::ordered_json value_json(const protocols::ParamValue& value);
bool same_value(const protocols::ParamValue& a, const protocols::ParamValue& b);

// What was set and is in force only after saving and a restart, in the node's words; empty for none, and for nodes that do not say it.
std::string waits_for_restart(ToolNode& tool, std::uint8_t node);

// What makes a node itself and not a copy of another: never restored or cloned unasked.
bool names_the_node(const std::string& parameter_name);
// What an ESC of rotorloop shows among its parameters and keeps nowhere: readings, and the values of a commissioning.
bool only_read(const std::string& parameter_name);

// Text of a parameter file (TOML): where the values came from, then one line for each.
std::string parameter_file(const SeenNode& node, const std::vector<NodeParameter>& parameters);
// Names and values as text, with the line of each for messages. Throws Error (exit 2).
struct FileValue {
  std::string text, where;
};
std::map<std::string, FileValue> read_parameter_file(const std::string& path);

}  // namespace rotorloop::tools
