#include "proxy/silhouettes/colour_rule.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdlib>

#include "scene/program/error.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace {

using Rule = ColourRule;
constexpr std::string_view kVariables = "RGBHSVLXY";
constexpr std::size_t kMaxStack = 64;
constexpr std::size_t kMaxLength = 4096;

class RuleParser {
 public:
  RuleParser(const std::string& text, std::vector<ColourRule::Step>& out) : text_(text), out_(out) {
    if (text.size() > kMaxLength)
      throw UsageError("the colour rule is longer than " + std::to_string(kMaxLength) + " characters");
    Or();
    Skip();
    if (at_ < text_.size()) Fail("an operator or the end");
  }

 private:
  [[noreturn]] void Fail(const std::string& wanted) const {
    throw UsageError(fmt::format("the colour rule \"{}\" is not understood at character {}: {} is expected there",
                                 text_, at_ + 1, wanted),
                     "for example: \"(B - R) < 25 && R + G + B > 60\"");
  }
  void Skip() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_])) != 0) ++at_;
  }
  bool Take(const std::string& t) {
    Skip();
    if (text_.compare(at_, t.size(), t) != 0) return false;
    const auto letter = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; };
    if (letter(t[0]) && at_ + t.size() < text_.size() && letter(text_[at_ + t.size()])) return false;
    at_ += t.size();
    return true;
  }
  void Emit(char op, double number = 0) { out_.push_back({op, number}); }
  struct Deeper {
    explicit Deeper(RuleParser& p) : p_(p) {
      if (++p_.depth_ > kMaxStack / 2) throw UsageError("the colour rule is nested too deeply");
    }
    ~Deeper() { --p_.depth_; }
    RuleParser& p_;
  };

  void Or() {
    const Deeper deeper(*this);
    And();
    while (Take("||") || Take("or")) {
      And();
      Emit('|');
    }
  }
  void And() {
    Not();
    while (Take("&&") || Take("and")) {
      Not();
      Emit('&');
    }
  }
  void Not() {
    Skip();
    const bool unequal = text_.compare(at_, 2, "!=") == 0;
    if (!unequal && (Take("!") || Take("not"))) {
      const Deeper deeper(*this);
      Not();
      Emit('!');
      return;
    }
    Compare();
  }
  void Compare() {
    Sum();
    for (const auto& [token, op] : {std::pair{"<=", Rule::kLessEqual},
                                    {">=", Rule::kGreaterEqual},
                                    {"==", '='},
                                    {"!=", Rule::kUnequal},
                                    {"<", '<'},
                                    {">", '>'}}) {
      if (!Take(token)) continue;
      Sum();
      Emit(op);
      return;
    }
  }
  void Sum() {
    Product();
    for (;;) {
      const bool add = Take("+");
      if (!add && !Take("-")) return;
      Product();
      Emit(add ? '+' : '-');
    }
  }
  void Product() {
    Unary();
    for (;;) {
      const bool multiply = Take("*");
      if (!multiply && !Take("/")) return;
      Unary();
      Emit(multiply ? '*' : '/');
    }
  }
  void Unary() {
    const Deeper deeper(*this);
    if (Take("-")) {
      Unary();
      Emit(Rule::kNegate);
    } else if (Take("+")) {
      Unary();
    } else {
      Primary();
    }
  }
  void Expect(const char* token) {
    if (!Take(token)) Fail(std::string("\"") + token + "\"");
  }
  void Primary() {
    Skip();
    if (Take("(")) {
      Or();
      Expect(")");
      return;
    }
    for (const auto& [name, op] : {std::pair{"min", Rule::kMin}, {"max", Rule::kMax}}) {
      if (!Take(name)) continue;
      Expect("(");
      Or();
      Expect(",");
      Or();
      Expect(")");
      Emit(op);
      return;
    }
    if (Take("abs")) {
      Expect("(");
      Or();
      Expect(")");
      Emit(Rule::kAbs);
      return;
    }
    for (const char name : kVariables)
      if (Take(std::string(1, name)) || Take(std::string(1, static_cast<char>(std::tolower(name))))) return Emit(name);
    if (at_ < text_.size() && (std::isdigit(static_cast<unsigned char>(text_[at_])) != 0 || text_[at_] == '.')) {
      char* end = nullptr;
      const double number = std::strtod(text_.c_str() + at_, &end);
      if (end != text_.c_str() + at_ && std::isfinite(number)) {
        at_ = static_cast<std::size_t>(end - text_.c_str());
        return Emit(Rule::kNumber, number);
      }
    }
    Fail("a number, R G B H S V L X Y, or \"(\"");
  }

  const std::string& text_;
  std::vector<ColourRule::Step>& out_;
  std::size_t at_ = 0;
  std::size_t depth_ = 0;
};

double HueDegrees(const double rgb[3], double most, double range) {
  if (!(range > 0)) return 0;
  double h;
  if (most == rgb[0])
    h = (rgb[1] - rgb[2]) / range;
  else if (most == rgb[1])
    h = 2 + (rgb[2] - rgb[0]) / range;
  else
    h = 4 + (rgb[0] - rgb[1]) / range;
  return h < 0 ? 60 * (h + 6) : 60 * h;
}

}  // namespace

ColourRule::ColourRule(const std::string& text) {
  RuleParser(text, steps_);
  // How much room its evaluation takes.
  std::size_t depth = 0;
  for (const Step& s : steps_) {
    const bool value = s.op == Rule::kNumber || kVariables.find(s.op) != kVariables.npos,
               unary = s.op == Rule::kNegate || s.op == '!' || s.op == Rule::kAbs;
    if (value)
      ++depth;
    else if (!unary)
      --depth;
    if (depth > kMaxStack) throw UsageError("the colour rule is nested too deeply");
  }
}

double ColourRule::Evaluate(const double rgb[3], double x_px, double y_px) const {
  std::array<double, kMaxStack> stack;
  std::size_t n = 0;
  const double most = std::max({rgb[0], rgb[1], rgb[2]}), range = most - std::min({rgb[0], rgb[1], rgb[2]});
  for (const Step& s : steps_) {
    const auto two = [&](auto f) {
      --n;
      stack[n - 1] = f(stack[n - 1], stack[n]);
    };
    switch (s.op) {
      case Rule::kNumber: stack[n++] = s.number; break;
      case 'R': stack[n++] = rgb[0]; break;
      case 'G': stack[n++] = rgb[1]; break;
      case 'B': stack[n++] = rgb[2]; break;
      case 'H': stack[n++] = HueDegrees(rgb, most, range); break;
      case 'S': stack[n++] = most > 0 ? range / most : 0; break;
      case 'V': stack[n++] = most / 255; break;
      case 'L': stack[n++] = 0.299 * rgb[0] + 0.587 * rgb[1] + 0.114 * rgb[2]; break;
      case 'X': stack[n++] = x_px; break;
      case 'Y': stack[n++] = y_px; break;
      case '+': two([](double a, double b) { return a + b; }); break;
      case '-': two([](double a, double b) { return a - b; }); break;
      case '*': two([](double a, double b) { return a * b; }); break;
      case '/': two([](double a, double b) { return b == 0 ? std::nan("") : a / b; }); break;
      case Rule::kNegate: stack[n - 1] = -stack[n - 1]; break;
      case '<': two([](double a, double b) { return a < b ? 1.0 : 0.0; }); break;
      case Rule::kLessEqual: two([](double a, double b) { return a <= b ? 1.0 : 0.0; }); break;
      case '>': two([](double a, double b) { return a > b ? 1.0 : 0.0; }); break;
      case Rule::kGreaterEqual: two([](double a, double b) { return a >= b ? 1.0 : 0.0; }); break;
      case '=': two([](double a, double b) { return a == b ? 1.0 : 0.0; }); break;
      case Rule::kUnequal: two([](double a, double b) { return a < b || a > b ? 1.0 : 0.0; }); break;
      case '&': two([](double a, double b) { return a != 0 && b != 0 ? 1.0 : 0.0; }); break;
      case '|': two([](double a, double b) { return a != 0 || b != 0 ? 1.0 : 0.0; }); break;
      case '!': stack[n - 1] = stack[n - 1] != 0 ? 0.0 : 1.0; break;
      case Rule::kMin: two([](double a, double b) { return std::min(a, b); }); break;
      case Rule::kMax: two([](double a, double b) { return std::max(a, b); }); break;
      case Rule::kAbs: stack[n - 1] = std::abs(stack[n - 1]); break;
    }
  }
  return stack[0];
}

Image8 SilhouetteFromRule(const Image8& photo, const ColourRule& rule) {
  if (photo.channels < 3) throw std::invalid_argument("a photo without colours");
  Image8 out(photo.width, photo.height, 1);
  ParallelFor(static_cast<std::size_t>(photo.height), 16, [&](std::size_t begin, std::size_t end) {
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      for (int x = 0; x < photo.width; ++x) {
        const double rgb[3] = {static_cast<double>(photo.At(x, y, 0)), static_cast<double>(photo.At(x, y, 1)),
                               static_cast<double>(photo.At(x, y, 2))};
        const double value = rule.Evaluate(rgb, x + 0.5, y + 0.5);
        out.At(x, y, 0) = value != 0 && !std::isnan(value) ? 255 : 0;
      }
    }
  });
  return out;
}

}  // namespace lumi
