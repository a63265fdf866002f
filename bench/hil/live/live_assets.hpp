// What the live pages are made of, in the program itself; made by cmake/assets.cmake from page/ and third_party/uplot.
#pragma once
#include <string_view>

namespace rotorloop::live {

extern const std::string_view kUplotScript, kUplotStyle, kLiveScript, kLiveStyle, kEscsPage, kEscsScript, kStandPage, kStandScript;

}  // namespace rotorloop::live
