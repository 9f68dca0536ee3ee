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

using Op = ColourRule::Op;
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
  bool Take(const char* token) {
    Skip();
    const std::string t = token;
    if (text_.compare(at_, t.size(), t) != 0) return false;
    const auto letter = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; };
    if (letter(t[0]) && at_ + t.size() < text_.size() && letter(text_[at_ + t.size()])) return false;
    at_ += t.size();
    return true;
  }
  void Emit(Op op, double number = 0) { out_.push_back({op, number}); }
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
      Emit(Op::kOr);
    }
  }
  void And() {
    Not();
    while (Take("&&") || Take("and")) {
      Not();
      Emit(Op::kAnd);
    }
  }
  void Not() {
    Skip();
    const bool unequal = text_.compare(at_, 2, "!=") == 0;
    if (!unequal && (Take("!") || Take("not"))) {
      const Deeper deeper(*this);
      Not();
      Emit(Op::kNot);
      return;
    }
    Compare();
  }
  void Compare() {
    Sum();
    static constexpr std::array<std::pair<const char*, Op>, 6> kOps = {{{"<=", Op::kLessEqual},
                                                                        {">=", Op::kGreaterEqual},
                                                                        {"==", Op::kEqual},
                                                                        {"!=", Op::kNotEqual},
                                                                        {"<", Op::kLess},
                                                                        {">", Op::kGreater}}};
    for (const auto& [token, op] : kOps) {
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
      Emit(add ? Op::kAdd : Op::kSubtract);
    }
  }
  void Product() {
    Unary();
    for (;;) {
      const bool multiply = Take("*");
      if (!multiply && !Take("/")) return;
      Unary();
      Emit(multiply ? Op::kMultiply : Op::kDivide);
    }
  }
  void Unary() {
    const Deeper deeper(*this);
    if (Take("-")) {
      Unary();
      Emit(Op::kNegate);
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
    for (const auto& [name, op] : {std::pair{"min", Op::kMin}, {"max", Op::kMax}}) {
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
      Emit(Op::kAbs);
      return;
    }
    static constexpr std::array<std::pair<const char*, Op>, 9> kNames = {{{"R", Op::kR},
                                                                          {"G", Op::kG},
                                                                          {"B", Op::kB},
                                                                          {"H", Op::kH},
                                                                          {"S", Op::kS},
                                                                          {"V", Op::kV},
                                                                          {"L", Op::kL},
                                                                          {"X", Op::kX},
                                                                          {"Y", Op::kY}}};
    for (const auto& [name, op] : kNames) {
      const std::string small(1, static_cast<char>(std::tolower(static_cast<unsigned char>(name[0]))));
      if (Take(name) || Take(small.c_str())) return Emit(op);
    }
    if (at_ < text_.size() && (std::isdigit(static_cast<unsigned char>(text_[at_])) != 0 || text_[at_] == '.')) {
      char* end = nullptr;
      const double number = std::strtod(text_.c_str() + at_, &end);
      if (end != text_.c_str() + at_ && std::isfinite(number)) {
        at_ = static_cast<std::size_t>(end - text_.c_str());
        return Emit(Op::kNumber, number);
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
    const bool value = s.op <= Op::kY, unary = s.op == Op::kNegate || s.op == Op::kNot || s.op == Op::kAbs;
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
      case Op::kNumber: stack[n++] = s.number; break;
      case Op::kR: stack[n++] = rgb[0]; break;
      case Op::kG: stack[n++] = rgb[1]; break;
      case Op::kB: stack[n++] = rgb[2]; break;
      case Op::kH: stack[n++] = HueDegrees(rgb, most, range); break;
      case Op::kS: stack[n++] = most > 0 ? range / most : 0; break;
      case Op::kV: stack[n++] = most / 255; break;
      case Op::kL: stack[n++] = 0.299 * rgb[0] + 0.587 * rgb[1] + 0.114 * rgb[2]; break;
      case Op::kX: stack[n++] = x_px; break;
      case Op::kY: stack[n++] = y_px; break;
      case Op::kAdd: two([](double a, double b) { return a + b; }); break;
      case Op::kSubtract: two([](double a, double b) { return a - b; }); break;
      case Op::kMultiply: two([](double a, double b) { return a * b; }); break;
      case Op::kDivide: two([](double a, double b) { return b == 0 ? std::nan("") : a / b; }); break;
      case Op::kNegate: stack[n - 1] = -stack[n - 1]; break;
      case Op::kLess: two([](double a, double b) { return a < b ? 1.0 : 0.0; }); break;
      case Op::kLessEqual: two([](double a, double b) { return a <= b ? 1.0 : 0.0; }); break;
      case Op::kGreater: two([](double a, double b) { return a > b ? 1.0 : 0.0; }); break;
      case Op::kGreaterEqual: two([](double a, double b) { return a >= b ? 1.0 : 0.0; }); break;
      case Op::kEqual: two([](double a, double b) { return a == b ? 1.0 : 0.0; }); break;
      case Op::kNotEqual: two([](double a, double b) { return a < b || a > b ? 1.0 : 0.0; }); break;
      case Op::kAnd: two([](double a, double b) { return a != 0 && b != 0 ? 1.0 : 0.0; }); break;
      case Op::kOr: two([](double a, double b) { return a != 0 || b != 0 ? 1.0 : 0.0; }); break;
      case Op::kNot: stack[n - 1] = stack[n - 1] != 0 ? 0.0 : 1.0; break;
      case Op::kMin: two([](double a, double b) { return std::min(a, b); }); break;
      case Op::kMax: two([](double a, double b) { return std::max(a, b); }); break;
      case Op::kAbs: stack[n - 1] = std::abs(stack[n - 1]); break;
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
