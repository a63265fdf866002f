// What the residuals say, as a part of the value tree: figures of every test, no series but those that a table cannot replace.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "bench/sysid/diagnose/residuals/residual_findings.hpp"

namespace rotorloop::diagnose {

nlohmann::ordered_json residual_tree(const ResidualFindings& findings);

}  // namespace rotorloop::diagnose
