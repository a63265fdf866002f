#include "bench/render/outcome.hpp"

#include "bench/render/page.hpp"
#include "bench/render/svg_pieces.hpp"

namespace rotorloop::render {
namespace {

const char* style_of(Standing s) { return s == Standing::good ? "pass" : s == Standing::bad ? "fail" : "incomplete"; }

std::string one_line(std::string text) {
  for (char& c : text)
    if (c == '\n') c = ' ';
  return text;
}

}  // namespace

std::string banner_html(const Outcome& o) {
  std::string out =
      std::string("<div class=\"verdict ") + style_of(o.standing) + "\" role=\"status\"><b>" + xml_escaped(o.verdict) + "</b><div>";
  if (!o.sentence.empty()) out += "<p>" + xml_escaped(o.sentence) + "</p>";
  if (!o.errors.empty()) {
    out += "<ul>";
    for (const std::string& e : o.errors) out += "<li>" + xml_escaped(e) + "</li>";
    out += "</ul>";
  }
  if (!o.next.empty()) out += "<p class=\"next\">Next: " + xml_escaped(o.next) + "</p>";
  return out + "</div></div>\n";
}

std::string outcome_text(const Outcome& o) {
  std::string out = "verdict: " + o.verdict + "\n";
  for (const std::string& e : o.errors) out += "error:   " + one_line(e) + "\n";
  if (!o.next.empty()) out += "next:    " + one_line(o.next) + "\n";
  return out;
}

std::string outcome_page_html(const std::string& title, const std::string& subtitle, const std::string& tab, const Outcome& o) {
  return page_begin(title, subtitle, tab) + banner_html(o) + page_end();
}

}  // namespace rotorloop::render
