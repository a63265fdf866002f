#pragma once
#include <filesystem>
#include <string_view>

namespace rotorloop {

// Writes a text file or throws Error (ExitCode::device): full disk, no permission. Until it is whole it is called PATH.part.
void write_text_file(const std::filesystem::path& path, std::string_view text);

}  // namespace rotorloop
