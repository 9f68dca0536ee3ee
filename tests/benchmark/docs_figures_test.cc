#include "tests/benchmark/docs_figures.h"

#include <gmock/gmock.h>

#include <fstream>
#include <iterator>
#include <regex>
#include <set>

#include "scene/program/error.h"

namespace lumi {
namespace {

using ::testing::HasSubstr;

PrintedFigures Example() {
  PrintedFigures figures;
  figures["render"] = {"./bench.sh --only render",
                       "A processor, 2 cores; GCC",
                       "1.2 (abc)",
                       12,
                       {"## Held out", "", "| capture | proxy | PSNR dB |", "|---|---|---|", "| desk | mesh | 26.684 |",
                        "| | dense | 27.1 |", "| fox | mesh | 24.0 +- 0.2 |", "", "## Fly-through", "", "```",
                        "## no heading", "sparse 12.5 ms a frame", "```", ""}};
  return figures;
}

std::string Filled(const std::string& markdown) { return FillInFigures(markdown, "page.md", Example()); }

std::string Refusal(const std::string& markdown) {
  try {
    Filled(markdown);
  } catch (const Error& e) {
    return e.what();
  }
  return "nothing was refused";
}

TEST(DocsFigures, WhatStandsBelowAHeadingReplacesWhatTheMarkHeld) {
  EXPECT_EQ(
      Filled("a\n<!-- figures render: Fly-through -->\nold\n<!-- end -->\nb\n"),
      "a\n<!-- figures render: Fly-through -->\n```\n## no heading\nsparse 12.5 ms a frame\n```\n<!-- end -->\nb\n");
}

TEST(DocsFigures, ACellIsFoundByItsRowAndColumn) {
  EXPECT_EQ(Filled("<!-- figure render: Held out | desk | PSNR dB -->?<!-- end --> dB"),
            "<!-- figure render: Held out | desk | PSNR dB -->26.684<!-- end --> dB");
  EXPECT_EQ(Filled("<!-- figure render: Held out | desk | PSNR dB | 1 --><!-- end -->"),
            "<!-- figure render: Held out | desk | PSNR dB | 1 -->26.7<!-- end -->");
  EXPECT_EQ(Filled("<!-- figure render: Held out | fox | PSNR dB | 2 --><!-- end -->"),
            "<!-- figure render: Held out | fox | PSNR dB | 2 -->24.00<!-- end -->");
}

TEST(DocsFigures, AnEmptyFirstCellIsTheOneAbove) {
  EXPECT_EQ(Filled("<!-- figure render: Held out | desk / dense | PSNR dB --><!-- end -->"),
            "<!-- figure render: Held out | desk / dense | PSNR dB -->27.1<!-- end -->");
}

TEST(DocsFigures, ARegularExpressionFindsWhatIsInNoTable) {
  EXPECT_EQ(Filled("<!-- figure render: Fly-through ~ ([0-9.]+) ms --><!-- end -->"),
            "<!-- figure render: Fly-through ~ ([0-9.]+) ms -->12.5<!-- end -->");
}

TEST(DocsFigures, AllPartsAreListedWithTheirSum) {
  EXPECT_EQ(Filled("<!-- figures all -->\n<!-- end -->"),
            "<!-- figures all -->\n| part | command | machine | version | minutes |\n|---|---|---|---|---|\n"
            "| render | `./bench.sh --only render` | A processor, 2 cores | 1.2 (abc) | 0.2 |\n| all | | | | 0 |\n<!-- "
            "end -->");
}

TEST(DocsFigures, FillingInTwiceChangesNothing) {
  const std::string once = Filled(
      "<!-- figure render: Held out | desk | PSNR dB -->1<!-- end -->, and\n"
      "<!-- figures render: Held out -->\n<!-- end -->\n");
  EXPECT_EQ(Filled(once), once);
}

TEST(DocsFigures, WhatWasNotPrintedIsRefusedWithItsLine) {
  EXPECT_THAT(Refusal("\n\n<!-- figures other: Held out -->\n<!-- end -->"),
              HasSubstr("line 3: docs/figures.json has no part 'other'"));
  EXPECT_THAT(Refusal("<!-- figures render: Held -->\n<!-- end -->"), HasSubstr("no heading 'Held'"));
  EXPECT_THAT(Refusal("<!-- figure render: Held out | plaza | PSNR dB --><!-- end -->"), HasSubstr("no row 'plaza'"));
  EXPECT_THAT(Refusal("<!-- figure render: Held out | desk | SSIM --><!-- end -->"), HasSubstr("column 'SSIM'"));
  EXPECT_THAT(Refusal("<!-- figure render: Held out | desk | proxy | 1 --><!-- end -->"), HasSubstr("is no number"));
  EXPECT_THAT(Refusal("<!-- figure render: Held out | desk --><!-- end -->"), HasSubstr("is wanted"));
  EXPECT_THAT(Refusal("<!-- figure render: Fly-through ~ ([0-9]+) miles --><!-- end -->"),
              HasSubstr("nothing printed matches"));
  EXPECT_THAT(Refusal("<!-- figure render: Fly-through ~ ( --><!-- end -->"), HasSubstr("no regular expression"));
}

TEST(DocsFigures, AMarkThatIsNotClosedIsRefused) {
  EXPECT_THAT(Refusal("<!-- figures render: Held out -->\n"), HasSubstr("without their <!-- end -->"));
  EXPECT_THAT(Refusal("<!-- figures render: Held out -->\n<!-- figures render: Held out -->\n<!-- end -->"),
              HasSubstr("without their <!-- end -->"));
  EXPECT_THAT(Refusal("<!-- figures render: Held out"), HasSubstr("without its -->"));
}

TEST(DocsFigures, TheFileKeepsWhatWasPrinted) {
  const std::filesystem::path file = std::filesystem::path(::testing::TempDir()) / "docs_figures.json";
  std::ofstream(file) << ToJson(Example());
  EXPECT_EQ(ToJson(ReadPrintedFigures(file)), ToJson(Example()));
  std::ofstream(file) << "{\"parts\": 3}";
  EXPECT_THROW(ReadPrintedFigures(file), InputError);
}

TEST(DocsFigures, WhatIsKeptHasNoPathsOfTheMachine) {
  EXPECT_EQ(WithoutRoot({"against /home/me/lumi/build/a, /home/me/lumi/b", "/home/me/lumi-2/c", ""}, "/home/me/lumi/."),
            (std::vector<std::string>{"against build/a, b", "/home/me/lumi-2/c", ""}));
  for (const auto& [part, printed] : ReadPrintedFigures(std::filesystem::path(LUMI_SOURCE_DIR) / kFiguresFile))
    for (const std::string& line : printed.lines)
      EXPECT_FALSE(std::regex_search(line, std::regex("(^|[ \"(])/[A-Za-z]"))) << part << ": " << line;
}

// The figures in README and docs are those that bench.sh printed: ./bench.sh --update-docs writes both.
TEST(DocsFigures, PagesSayWhatTheBenchPrinted) {
  const std::filesystem::path root = LUMI_SOURCE_DIR;
  const PrintedFigures figures = ReadPrintedFigures(root / kFiguresFile);
  ASSERT_FALSE(figures.empty());
  int marks = 0;
  for (const std::filesystem::path& page : PagesWithFigures(root)) {
    std::ifstream in(page);
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    ASSERT_FALSE(text.empty()) << page;
    marks += text.find("<!-- figure") != std::string::npos;
    EXPECT_EQ(FillInFigures(text, page.string(), figures), text)
        << page << ": run build/release/bin/docs_figures update";
  }
  EXPECT_GT(marks, 3);
}

// What the text between code blocks says, without what is filled in, and without lines of commands.
std::string TextIn(const std::string& section) {
  static const std::regex blocks("```[^]*?```"), marks("<!-- figures? [^]*?<!-- end -->"), commands("(^|\n)    [^\n]*");
  return std::regex_replace(std::regex_replace(std::regex_replace(section, blocks, ""), marks, ""), commands, "\n");
}

// A figure in decibels or milliseconds was measured: its section names what prints it.
TEST(DocsFigures, WhatWasMeasuredNamesItsOrigin) {
  static const std::regex figure("(^|[^.\\w])[0-9]+(\\.[0-9]+)? (dB|ms)($|[^\\w])"),
      table("\\|[^\n]*(\\b(dB|ms|seconds|MB|PSNR|px|ratio)\\b|%)[^\n]*\\|\n\\|[-|]+\\|"),
      // A part of bench.sh, a script, a bench program, a test, one of our programs with its arguments, or a paper.
      origin(
          "bench\\.sh "
          "--only|scripts/[a-z-]+\\.sh|[a-z]_bench|tests/[a-z_/]+|`[A-Z][A-Za-z]+\\.[A-Z][A-Za-z]*|`lumi-[a-z]+ [^`]|"
          "<!-- figure|(^|\n)    lumi-|[A-Z][a-z]+ et al\\. [0-9]{4}");
  // Settings of the viewer, and budgets.
  const std::set<std::string> no_measurement{"viewer.md: ## Mouse and keys", "tradeoff.md: ## tradeoff"};
  int measured = 0;
  for (const std::filesystem::path& page : PagesWithFigures(LUMI_SOURCE_DIR)) {
    std::ifstream in(page);
    std::vector<std::string> sections(1);
    for (std::string line; std::getline(in, line);) {
      if (line.starts_with("#")) sections.emplace_back();
      sections.back() += line + "\n";
    }
    for (const std::string& section : sections) {
      const std::string text = TextIn(section);
      if (!std::regex_search(text, figure) && !std::regex_search(text, table)) continue;
      ++measured;
      const std::string name = page.filename().string() + ": " + section.substr(0, section.find('\n'));
      EXPECT_TRUE(std::regex_search(section, origin) || no_measurement.contains(name))
          << name << ": say which command prints its figures";
    }
  }
  EXPECT_GE(measured, 15);
}

}  // namespace
}  // namespace lumi
