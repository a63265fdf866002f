#include "cli/ending/junit.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace rotorloop::cli {
namespace {

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\n':
        out += "&#10;";
        break;
      default:
        out += static_cast<unsigned char>(c) < 0x20 || c == 0x7F ? '?' : c;
    }
  }
  return out;
}

}  // namespace

std::string junit_xml(const std::string& suite, const std::vector<JunitCase>& cases) {
  const auto ended = [&](JunitEnd end) {
    return std::count_if(cases.begin(), cases.end(), [&](const JunitCase& c) { return c.end == end; });
  };
  const std::string counts = fmt::format("tests=\"{}\" failures=\"{}\" errors=\"{}\" skipped=\"{}\"", cases.size(), ended(JunitEnd::failed),
                                         ended(JunitEnd::error), ended(JunitEnd::skipped));
  std::string out =
      fmt::format("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites {0}>\n<testsuite name=\"{1}\" {0}>\n", counts, escaped(suite));
  for (const JunitCase& c : cases) {
    out += fmt::format("<testcase classname=\"{}\" name=\"{}\"", escaped(c.group), escaped(c.name));
    if (c.end == JunitEnd::passed) {
      out += "/>\n";
      continue;
    }
    const char* const element = c.end == JunitEnd::failed ? "failure" : c.end == JunitEnd::error ? "error" : "skipped";
    out += fmt::format("><{} message=\"{}\"/></testcase>\n", element, escaped(c.message));
  }
  return out + "</testsuite>\n</testsuites>\n";
}

}  // namespace rotorloop::cli
