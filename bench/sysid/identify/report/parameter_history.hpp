// Parameter history: each parameter over several results of `identify` (the paper's Fig. 8).
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "bench/sysid/identify/report/history_point.hpp"

namespace rotorloop::identify {

// Reads result.json, given itself or its folder. Throws Error for anything but a result of `identify`.
HistoryPoint read_history_point(const std::filesystem::path& path);
// Reads all; folders of the same name are distinguished by the folders that they stand in.
std::vector<HistoryPoint> read_history(const std::vector<std::filesystem::path>& paths);

// Each result counts q_BS from the start value of its own fit. Here all are counted from one rotation, that of the first reference, else
// of the first trial that says its own: the three numbers become the rotation from there. Returns what they are counted from, for
// the caption, and takes the numbers out of trials that do not say their rotation; empty: no trial says it.
std::string count_rotations_from_one(std::vector<HistoryPoint>& history, const std::vector<HistoryReference>& references);

// Section of the page; empty for fewer than two trials. Shows what the last one has.
std::string history_html(std::vector<HistoryPoint> history, std::vector<HistoryReference> references);

}  // namespace rotorloop::identify
