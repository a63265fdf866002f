// What a loop comes to, put together from the files of its stages alone: result.json, the page and the table are made of this, and can
// be made again from an old run folder.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "bench/hil/closed_loop/findings.hpp"
#include "bench/hil/closed_loop/isolation_record.hpp"
#include "bench/hil/closed_loop/plan.hpp"
#include "bench/hil/closed_loop/tracking.hpp"
#include "bench/hil/closed_loop/truth.hpp"
#include "bench/render/outcome.hpp"

namespace rotorloop::closed_loop {

struct LoopResult {
  std::filesystem::path run;
  LoopPlan plan;
  std::string command_line, version;
  IsolationSummary isolation;  // of the diagnosis
  Findings findings;
  bool identified = false;       // the sandboxed identification gave a vehicle file
  bool after_is_before = false;  // the diagnosis gave no vehicle file that can be flown: nothing was flown again
  std::string why_not_flown;     // then: why
  std::vector<TrackedFlight> tracking;
  bool pass = false;            // every judged flight
  bool truth_compared = false;  // `rotorloop close truth` has compared
  TruthComparison truth;
};

// Why a vehicle file of the diagnosis cannot be flown: there is none, or what is wrong with it. Empty: it can.
std::string why_not_flyable(const std::filesystem::path& vehicle);

// Throws Error for a folder that is no loop's or not complete.
LoopResult assemble_loop(const std::filesystem::path& run);

// Why it passed or not, and what to do next.
render::Outcome loop_outcome(const LoopResult& r);

std::string loop_result_json(const LoopResult& result);
std::string loop_result_text(const LoopResult& result);  // for a terminal

}  // namespace rotorloop::closed_loop
