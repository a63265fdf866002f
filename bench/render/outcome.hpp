// How a command ended, told in the same way on every page and terminal: the verdict, why it is not better, and what to do next.
#pragma once
#include <string>
#include <vector>

namespace rotorloop::render {

enum class Standing { good, bad, open };  // open: neither passed nor failed

struct Outcome {
  std::string verdict;  // one word, as in result.json: "pass", "fail", "incomplete", "refused"; of a diagnosis its own
  Standing standing = Standing::open;
  std::string sentence = {};             // what it rests on
  std::vector<std::string> errors = {};  // why the result is not what was asked for; empty when it is
  std::string next = {};                 // what to do now
};

// The banner at the head of a page.
std::string banner_html(const Outcome& outcome);
// "verdict: fail", a line for each error, "next: …".
std::string outcome_text(const Outcome& outcome);
// A whole page with nothing but a banner, for a command that found nothing it could show.
std::string outcome_page_html(const std::string& title, const std::string& subtitle, const std::string& tab, const Outcome& outcome);

}  // namespace rotorloop::render
