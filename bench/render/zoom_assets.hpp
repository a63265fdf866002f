// What zoomable plots are drawn with, in the program itself; made by cmake/assets.cmake from zoom/ and third_party/uplot.
#pragma once
#include <string_view>

namespace rotorloop::render {

extern const std::string_view kUplotScript, kUplotStyle, kZoomScript, kZoomStyle;

}  // namespace rotorloop::render
