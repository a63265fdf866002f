// Looks at generated HTML and SVG as text: no browser is needed to see that a tag is left open.
#pragma once
#include <set>
#include <string>
#include <vector>

namespace rotorloop::test {

// First tag that is closed without being open or left open; empty when the tags of an XML or HTML text balance.
inline std::string unbalanced(const std::string& text) {
  const std::set<std::string> empty{"meta", "br", "!doctype"};
  std::vector<std::string> open;
  for (std::size_t at = text.find('<'); at != std::string::npos; at = text.find('<', at + 1)) {
    const auto end = text.find('>', at);
    if (end == std::string::npos) return "unterminated tag";
    const bool closing = text[at + 1] == '/', alone = text[end - 1] == '/';
    const auto name_at = at + (closing ? 2 : 1);
    const auto name = text.substr(name_at, text.find_first_of(" />", name_at) - name_at);
    if (closing) {
      if (open.empty() || open.back() != name) return "</" + name + "> after " + (open.empty() ? "nothing" : open.back());
      open.pop_back();
    } else if (!alone && !empty.contains(name)) {
      open.push_back(name);
    }
  }
  return open.empty() ? "" : "<" + open.back() + "> is left open";
}

inline std::size_t count(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

}  // namespace rotorloop::test
