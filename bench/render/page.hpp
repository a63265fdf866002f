// The frame that all pages share: head, style sheet for light and dark, title; and the blocks that every page uses.
#pragma once
#include <string>
#include <utility>
#include <vector>

namespace rotorloop::render {

// Plain text, escaped here. `tab` follows the title in the browser's tab.
std::string page_begin(const std::string& title, const std::string& subtitle, const std::string& tab);
std::string page_end();

// `caption_html` may hold markup; empty: none.
std::string figure_html(const std::string& caption_html, const std::string& svg);
// A row of small named values: "peak speed" -> "8.5 m/s". Plain text.
std::string facts_html(const std::vector<std::pair<std::string, std::string>>& facts);

}  // namespace rotorloop::render
