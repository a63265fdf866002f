// What a page shows of a run while it runs: place in the plan, newest values, limits and how near they are, steps that are done.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "bench/stand/run/session.hpp"

namespace rotorloop::stand_run {

// Of the newest `most_steps` steps: a page that is opened late still gets them. A value that nothing measures is null.
nlohmann::ordered_json live_values(const Session& session, std::size_t most_steps = 200);

}  // namespace rotorloop::stand_run
