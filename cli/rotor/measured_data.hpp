// Where measured data are: the one place that reads ROTORLOOP_DATA for the commands.
#pragma once
#include <filesystem>

namespace rotorloop::cli {

// The folder that ROTORLOOP_DATA names. Throws Error (data quality) when it is not set or holds no folder propellers.
std::filesystem::path measured_data_folder();

}  // namespace rotorloop::cli
