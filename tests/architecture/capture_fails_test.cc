// docs/capture-fails.md has every message that ends a program with exit code 1, and no message that no program says:
// whoever reads one on a terminal finds it there, with what it means and what to do.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <map>
#include <regex>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "scene/files/atomic_file.h"

namespace lumi {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr const char* kRefusingFolders[] = {"scene",  "simulate",     "calibrate", "reconstruct", "proxy",
                                            "render", "timeperiodic", "stabilize", "export",      "pipeline"};
// A stretch of a message that stands for the whole on the page, in characters. Of a message without one the whole is
// looked for, and shorter pieces (": {}") are no message.
constexpr std::size_t kTellingStretch = 20, kLeastMessage = 12;
// What makes a refusal, and which of its arguments is the message.
const std::map<std::string, int, std::less<>> kRefusals = {{"DataError", 0}, {"FactorizationRefused", 1}};

struct CppToken {
  enum class Kind { kWord, kLiteral, kMark };
  Kind kind = Kind::kMark;
  std::string text;  // of a literal: without its quotes and escapes
  int line = 0;
  bool IsMark(std::string_view any_of) const {
    return kind == Kind::kMark && any_of.find(text.front()) != std::string_view::npos;
  }
};

// The words, literals and marks of C++, without comments; literals beside each other are one, as the compiler has it.
class CppTokens {
 public:
  explicit CppTokens(std::string_view text) : text_(text) {
    while (at_ < text_.size()) TakeNext();
  }
  std::vector<CppToken> tokens;

 private:
  static bool IsWordPart(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

  void TakeNext() {
    const char c = text_[at_];
    if (std::isspace(static_cast<unsigned char>(c)) != 0)
      Skip(at_ + 1);
    else if (Follows("//"))
      Skip(text_.find('\n', at_));
    else if (Follows("/*"))
      Skip(EndOf("*/", at_));
    else if (Follows("R\""))
      TakeRawLiteral();
    else if (c == '"')
      AddLiteral(Quoted(c));
    else if (c == '\'')
      Quoted(c);
    else if (IsWordPart(c))
      TakeWord();
    else
      TakeMark();
  }

  bool Follows(std::string_view what) const { return text_.substr(at_).starts_with(what); }
  std::size_t EndOf(std::string_view what, std::size_t from) const {
    const std::size_t found = text_.find(what, from);
    return found == std::string_view::npos ? text_.size() : found + what.size();
  }

  void Skip(std::size_t to) {
    to = std::min(to, text_.size());
    line_ += static_cast<int>(std::count(text_.begin() + static_cast<std::ptrdiff_t>(at_),
                                         text_.begin() + static_cast<std::ptrdiff_t>(to), '\n'));
    at_ = to;
  }

  // Between two quotes, from the first of them on; an escaped character stands for itself, a line break is a blank.
  std::string Quoted(char quote) {
    std::string inside;
    for (++at_; at_ < text_.size() && text_[at_] != quote; ++at_) {
      const bool escaped = text_[at_] == '\\' && at_ + 1 < text_.size();
      if (escaped) ++at_;
      inside += escaped && text_[at_] == 'n' ? ' ' : text_[at_];
    }
    Skip(at_ + 1);
    return inside;
  }

  void TakeRawLiteral() {
    const std::size_t open = std::min(text_.find('(', at_), text_.size() - 1);
    const std::string close = ")" + std::string(text_.substr(at_ + 2, open - at_ - 2)) + "\"";
    const std::size_t end = EndOf(close, open), length = end - open - 1;
    AddLiteral(std::string(text_.substr(open + 1, length - std::min(length, close.size()))));
    Skip(end);
  }

  void TakeWord() {
    std::size_t end = at_;
    // 1'000 is one number.
    const bool number = std::isdigit(static_cast<unsigned char>(text_[at_])) != 0;
    while (end < text_.size() && (IsWordPart(text_[end]) || (number && text_[end] == '\''))) ++end;
    tokens.push_back({CppToken::Kind::kWord, std::string(text_.substr(at_, end - at_)), line_});
    at_ = end;
  }

  void TakeMark() {
    tokens.push_back({CppToken::Kind::kMark, std::string(1, text_[at_]), line_});
    ++at_;
  }

  void AddLiteral(const std::string& text) {
    if (!tokens.empty() && tokens.back().kind == CppToken::Kind::kLiteral)
      tokens.back().text += text;
    else
      tokens.push_back({CppToken::Kind::kLiteral, text, line_});
  }

  std::string_view text_;
  std::size_t at_ = 0;
  int line_ = 1;
};

std::string WithSingleBlanks(const std::string& text) {
  std::string single;
  for (const char c : text) {
    if (std::isspace(static_cast<unsigned char>(c)) == 0)
      single += c;
    else if (!single.empty() && single.back() != ' ')
      single += ' ';
  }
  return single;
}

std::string WithoutOuterBlanks(const std::string& text) {
  const auto first = text.find_first_not_of(' '), last = text.find_last_not_of(' ');
  return first == std::string::npos ? "" : text.substr(first, last - first + 1);
}

// "of {} photos" as the page writes it: "of ... photos".
std::string WithDots(const std::string& message) {
  static const std::regex placeholders(R"((\{[^{}]*\})+)");
  return std::regex_replace(message, placeholders, "...");
}

std::vector<std::string> PiecesBetweenDots(const std::string& text) {
  std::vector<std::string> pieces;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t dots = std::min(text.find("...", at), text.size());
    pieces.push_back(WithoutOuterBlanks(text.substr(at, dots - at)));
    at = dots + 3;
  }
  return pieces;
}

// What the page is to have of a literal; empty: nothing, it is no message.
std::string ToBeFound(const std::string& literal) {
  const std::string text = WithoutOuterBlanks(WithSingleBlanks(WithDots(literal)));
  std::size_t letters = 0;
  std::string longest;
  for (const std::string& piece : PiecesBetweenDots(text)) {
    letters += piece.size();
    if (piece.size() > longest.size()) longest = piece;
  }
  if (longest.size() >= kTellingStretch) return longest;
  return letters >= kLeastMessage ? text : "";
}

struct RefusalMessage {
  int line = 0;
  std::string text;
};

// The literals of the argument that is the message, wherever in it they stand; `open` is the token of its bracket.
void CollectMessages(const std::vector<CppToken>& tokens, std::size_t open, int argument,
                     std::vector<RefusalMessage>& found) {
  int depth = 0, current = 0;
  for (std::size_t i = open; i < tokens.size(); ++i) {
    const CppToken& token = tokens[i];
    if (token.IsMark("([{")) ++depth;
    if (token.IsMark(")]}") && --depth == 0) return;
    if (token.IsMark(",") && depth == 1) ++current;
    if (token.kind != CppToken::Kind::kLiteral || current != argument) continue;
    if (const std::string text = ToBeFound(token.text); !text.empty()) found.push_back({token.line, text});
  }
}

// DataError("..."), DataError named("..."), with fmt::format and without, and what is derived from it.
std::vector<RefusalMessage> MessagesOfRefusals(const std::vector<CppToken>& tokens) {
  std::vector<RefusalMessage> found;
  for (std::size_t i = 0; i + 2 < tokens.size(); ++i) {
    const auto refusal = tokens[i].kind == CppToken::Kind::kWord ? kRefusals.find(tokens[i].text) : kRefusals.end();
    if (refusal == kRefusals.end()) continue;
    const std::size_t open = tokens[i + 1].kind == CppToken::Kind::kWord ? i + 2 : i + 1;
    if (tokens[open].IsMark("({")) CollectMessages(tokens, open, refusal->second, found);
  }
  return found;
}

struct SourceWithRefusals {
  std::string file;  // relative to the root
  std::vector<CppToken> tokens;
};

std::vector<SourceWithRefusals> ReadStages(const std::filesystem::path& root) {
  std::vector<SourceWithRefusals> sources;
  for (const char* folder : kRefusingFolders)
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root / folder)) {
      const std::string ending = entry.path().extension().string();
      if (!entry.is_regular_file() || (ending != ".cc" && ending != ".h")) continue;
      const std::string text = ReadText(entry.path());
      sources.push_back({std::filesystem::relative(entry.path(), root).generic_string(), CppTokens(text).tokens});
    }
  std::ranges::sort(sources, {}, &SourceWithRefusals::file);
  return sources;
}

std::string CaptureFailsPage() {
  return ReadText(std::filesystem::path(LUMI_SOURCE_DIR) / "docs" / "capture-fails.md");
}

// What stands as code in the first cell of the tables' rows.
std::vector<std::string> MessagesOnPage(const std::string& page) {
  std::vector<std::string> messages;
  std::istringstream lines(page);
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("| `")) continue;
    const std::string cell = line.substr(0, line.find(" | "));
    for (std::size_t from = cell.find('`'); from != std::string::npos;) {
      const std::size_t to = std::min(cell.find('`', from + 1), cell.size());
      messages.push_back(cell.substr(from + 1, to - from - 1));
      from = cell.find('`', to + 1);
    }
  }
  return messages;
}

TEST(CaptureFails, ThePageHasEveryMessageOfExitCode1) {
  const std::string page = WithSingleBlanks(CaptureFailsPage());
  int messages = 0;
  for (const SourceWithRefusals& source : ReadStages(LUMI_SOURCE_DIR))
    for (const RefusalMessage& message : MessagesOfRefusals(source.tokens)) {
      ++messages;
      EXPECT_NE(page.find(message.text), std::string::npos)
          << source.file << ":" << message.line << ": docs/capture-fails.md lacks \"" << message.text << "\"";
    }
  EXPECT_GT(messages, 150);
}

TEST(CaptureFails, AProgramSaysEveryMessageOfThePage) {
  std::vector<std::string> literals;
  for (const SourceWithRefusals& source : ReadStages(LUMI_SOURCE_DIR))
    for (const CppToken& token : source.tokens)
      if (token.kind == CppToken::Kind::kLiteral) literals.push_back(WithSingleBlanks(token.text));
  const std::vector<std::string> messages = MessagesOnPage(CaptureFailsPage());
  EXPECT_GT(messages.size(), 150U);
  for (const std::string& message : messages)
    for (const std::string& piece : PiecesBetweenDots(message)) {
      if (piece.size() < kLeastMessage) continue;
      EXPECT_TRUE(
          std::ranges::any_of(literals, [&](const std::string& l) { return l.find(piece) != std::string::npos; }))
          << "docs/capture-fails.md: no program says \"" << piece << "\" of \"" << message << "\"";
    }
}

std::vector<std::string> TextsIn(const std::string& source) {
  std::vector<std::string> texts;
  for (const RefusalMessage& message : MessagesOfRefusals(CppTokens(source).tokens)) texts.push_back(message.text);
  return texts;
}

TEST(CaptureFails, MessagesAreFoundInTheCode) {
  EXPECT_THAT(TextsIn("throw DataError(\"no board was found\", \"more photos of it\", file);"),
              ElementsAre("no board was found"));
  EXPECT_THAT(TextsIn("throw DataError(\n  fmt::format(\"only {} of {} photos \"  // as asked\n"
                      "    \"got a camera, {:.0f} %\", a, b, c));"),
              ElementsAre("photos got a camera,"));
  EXPECT_THAT(TextsIn("const DataError little(\"too little\\n   stands \\\"still\\\" here\");"),
              ElementsAre("too little stands \"still\" here"));
  EXPECT_THAT(TextsIn("throw DataError(n == 1 ? \"it has one frame only\" : f(\"{}, numbers 0 to {}\", n));"),
              ElementsAre("it has one frame only", "..., numbers 0 to ..."));
  EXPECT_THAT(TextsIn("throw DataError(\"view \" + name + \" has a singular camera\");"),
              ElementsAre("has a singular camera"));
  EXPECT_THAT(TextsIn("throw FactorizationRefused(why, \"the camera does not move\", \"move the camera\");"),
              ElementsAre("the camera does not move"));
}

TEST(CaptureFails, WhatIsNoMessageIsPassedOver) {
  for (const char* source :
       {"// throw DataError(\"no board was found\");", "/* DataError(\"no board was found\") */",
        "catch (const DataError& e) { Say(\"no board was found\"); }", "throw DataError(refused.message);",
        "struct DataError : Error { const char* text = \"no board was found\"; };",
        "throw UsageError(\"--board takes columns x rows\");",
        "throw DataError(name + \": \" + reason, \"see the log\");",
        "const char quote = '\"'; // DataError(\"no board was found\")"})
    EXPECT_THAT(TextsIn(source), IsEmpty()) << source;
}

}  // namespace
}  // namespace lumi
