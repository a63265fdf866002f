#include "host/effects/expression_parse.hpp"

#include <charconv>
#include <cmath>

namespace rotorloop::host {
namespace {

bool is_name(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_'; }
bool is_digit(char c) { return (c >= '0' && c <= '9') || c == '.'; }

// Recursive descent; the first fault stands, and every step does nothing after it.
class Parser {
 public:
  Parser(std::string_view text, Expression& out) : text_(text), out_(out) { out_ = {}; }

  std::optional<ExpressionFault> run() {
    sum();
    skip();
    if (!fault_ && at_ < text_.size()) unexpected("an operator");
    return fault_;
  }

 private:
  void skip() {
    while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\t' || text_[at_] == '\n')) ++at_;
  }
  bool take(char c) {
    skip();
    if (fault_ || at_ >= text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }
  void fail(std::size_t at, std::string what, std::string remedy) {
    if (!fault_) fault_ = ExpressionFault{at + 1, std::move(what), std::move(remedy)};
  }
  void unexpected(const char* wanted) {
    skip();
    const bool end = at_ >= text_.size();
    const std::string found = end ? "the end" : std::string("\"") + text_[at_] + "\"";
    fail(at_, found + " where " + wanted + " was expected",
         !end && text_[at_] == '^' ? "there are no powers: write x * x" : "see docs/own_terms.md for what an expression may hold");
  }
  void expect(char c) {
    const char wanted[] = {'"', c, '"', '\0'};
    if (!take(c)) unexpected(wanted);
  }

  void put(Instruction i, int change_of_depth) {
    if (fault_) return;
    depth_ += change_of_depth;
    if (out_.length == Expression::kMaxLength || depth_ > static_cast<int>(Expression::kMaxDepth)) {
      fail(at_, "the expression is too long or nested too deeply",
           "at most 64 numbers, names and operators, and 12 values at a time: give parts of it parameters of their own");
      return;
    }
    out_.code[out_.length++] = i;
  }
  void put(Operation o, int change_of_depth) { put(Instruction{o, 0, 0.0}, change_of_depth); }

  void sum() {
    product();
    while (!fault_) {
      const Operation o = take('+') ? Operation::add : take('-') ? Operation::subtract : Operation::constant;
      if (o == Operation::constant) return;
      product();
      put(o, -1);
    }
  }
  void product() {
    sign();
    while (!fault_) {
      const Operation o = take('*') ? Operation::multiply : take('/') ? Operation::divide : Operation::constant;
      if (o == Operation::constant) return;
      sign();
      put(o, -1);
    }
  }
  void sign() {
    bool negative = false;
    for (;;) {
      if (take('-')) {
        negative = !negative;
      } else if (!take('+')) {
        break;
      }
    }
    value();
    if (negative) put(Operation::negate, 0);
  }
  void value() {
    if (take('(')) {
      inner();
      expect(')');
      return;
    }
    skip();
    if (fault_ || at_ >= text_.size()) return unexpected("a number, a variable or \"(\"");
    if (is_digit(text_[at_])) return number();
    if (is_name(text_[at_])) return name();
    unexpected("a number, a variable or \"(\"");
  }
  void inner() {
    constexpr int kMaxNesting = 24;  // of the parser itself
    if (++nesting_ > kMaxNesting) {
      fail(at_, "parentheses are nested too deeply", "at most 24 levels");
    } else {
      sum();
    }
    --nesting_;
  }
  void number() {
    double v = 0.0;
    const auto [end, error] = std::from_chars(text_.data() + at_, text_.data() + text_.size(), v);
    if (error != std::errc{} || !std::isfinite(v)) return fail(at_, "this is no number", "write it like 0.5 or 3e-6");
    at_ = static_cast<std::size_t>(end - text_.data());
    put(Instruction{Operation::constant, 0, v}, 1);
  }
  void name() {
    const std::size_t begin = at_;
    while (at_ < text_.size() && is_name(text_[at_])) ++at_;
    const std::string_view word = text_.substr(begin, at_ - begin);
    for (const auto& [function, o, two] : {std::tuple{"sqrt", Operation::square_root, false},
                                           {"abs", Operation::magnitude, false},
                                           {"min", Operation::smaller, true},
                                           {"max", Operation::larger, true}}) {
      if (word != function) continue;
      expect('(');
      inner();
      if (two) {
        expect(',');
        inner();
      }
      expect(')');
      return put(o, two ? -1 : 0);
    }
    for (std::size_t k = 0; k < std::size(kVariables); ++k) {
      if (kVariables[k].name == word) return put(Instruction{Operation::variable, static_cast<std::uint8_t>(k), 0.0}, 1);
    }
    fail(begin, "\"" + std::string(word) + "\" is neither a variable nor a function",
         "variables: " + variable_names() + "; functions: sqrt, abs, min, max");
  }

  std::string_view text_;
  Expression& out_;
  std::size_t at_ = 0;
  int depth_ = 0, nesting_ = 0;
  std::optional<ExpressionFault> fault_;
};

}  // namespace

std::optional<ExpressionFault> parse_expression(std::string_view text, Expression& out) { return Parser(text, out).run(); }

std::string variable_names() {
  std::string names;
  for (const VariableInfo& v : kVariables) names += (names.empty() ? "" : ", ") + std::string(v.name);
  return names;
}

}  // namespace rotorloop::host
