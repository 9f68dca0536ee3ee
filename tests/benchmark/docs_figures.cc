#include "tests/benchmark/docs_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>
#include <optional>
#include <regex>
#include <string_view>

#include "scene/files/open_to_read.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

constexpr std::string_view kEnd = "<!-- end -->", kClose = " -->";

std::string_view Trimmed(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

std::vector<std::string_view> Split(std::string_view text, std::string_view separator) {
  std::vector<std::string_view> parts;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find(separator, at), text.size());
    parts.push_back(Trimmed(text.substr(at, end - at)));
    at = end + separator.size();
  }
  return parts;
}

// The cells of a table's line; none for any other line.
std::vector<std::string_view> Cells(std::string_view line) {
  line = Trimmed(line);
  if (line.size() < 2 || line.front() != '|' || line.back() != '|') return {};
  return Split(line.substr(1, line.size() - 2), "|");
}

// What stands below a heading, up to the next one; without empty lines around it. A heading in a code block is none.
std::optional<std::vector<std::string_view>> Below(const PrintedPart& part, std::string_view heading) {
  std::vector<std::string_view> found;
  bool within = heading.empty(), known = heading.empty(), code = false;
  for (const std::string& line : part.lines) {
    if (line.starts_with("```")) code = !code;
    if (!code && line.starts_with("##")) {
      if (within) break;
      within = Trimmed(std::string_view(line).substr(line.find_first_not_of('#'))) == heading;
      known = known || within;
    } else if (within) {
      found.emplace_back(line);
    }
  }
  if (!known) return std::nullopt;
  while (!found.empty() && Trimmed(found.front()).empty()) found.erase(found.begin());
  while (!found.empty() && Trimmed(found.back()).empty()) found.pop_back();
  return found;
}

// A row whose first cells are `row`; where one is empty, the one above it counts.
std::optional<std::string> Cell(const std::vector<std::string_view>& lines, std::string_view row,
                                std::string_view column) {
  const std::vector<std::string_view> wanted = Split(row, " / ");
  std::optional<std::size_t> at;
  std::vector<std::string_view> above;
  bool in_table = false;
  for (const std::string_view line : lines) {
    std::vector<std::string_view> cells = Cells(line);
    if (cells.empty()) {
      in_table = false;
      continue;
    }
    if (!in_table) {  // its header
      in_table = true;
      const auto found = std::find(cells.begin(), cells.end(), column);
      at = found == cells.end() ? std::nullopt : std::optional(static_cast<std::size_t>(found - cells.begin()));
      above.clear();
      continue;
    }
    for (std::size_t i = 0; i < std::min({wanted.size(), cells.size(), above.size()}); ++i)
      if (cells[i].empty()) cells[i] = above[i];
    above = cells;
    if (at && *at < cells.size() && wanted.size() <= cells.size() &&
        std::equal(wanted.begin(), wanted.end(), cells.begin()))
      return std::string(cells[*at]);
  }
  return std::nullopt;
}

// The number at a cell's start with so many decimals: "27.351 +- 0.2" -> "27.4".
std::optional<std::string> Rounded(const std::string& cell, std::string_view decimals) {
  int wanted = 0;
  double value = 0;
  if (std::from_chars(decimals.data(), decimals.data() + decimals.size(), wanted).ec != std::errc() || wanted < 0 ||
      wanted > 9 || std::from_chars(cell.data(), cell.data() + cell.size(), value).ec != std::errc())
    return std::nullopt;
  return fmt::format("{:.{}f}", value, wanted);
}

class Filler {
 public:
  Filler(const std::string& markdown, const std::string& name, const PrintedFigures& figures)
      : text_(markdown), name_(name), figures_(figures) {}

  std::string Fill() {
    std::string out;
    std::size_t at = 0;
    while (true) {
      const std::size_t mark = NextMark(at);
      if (mark == std::string_view::npos) break;
      const std::size_t close = text_.find(kClose, mark);
      if (close == std::string_view::npos) Refuse(mark, "a mark without its -->");
      const std::size_t begin = close + kClose.size(), end = text_.find(kEnd, begin);
      if (end == std::string_view::npos || NextMark(begin) < end)
        Refuse(mark, fmt::format("figures without their {}", kEnd));
      out += text_.substr(at, begin - at);
      const bool block = text_.substr(mark).starts_with(kBlock);
      const std::string_view asked = text_.substr(mark, close - mark);
      out +=
          block ? "\n" + Block(mark, asked.substr(kBlock.size())) + "\n" : Number(mark, asked.substr(kInline.size()));
      out += kEnd;
      at = end + kEnd.size();
    }
    return out + std::string(text_.substr(at));
  }

 private:
  static constexpr std::string_view kBlock = "<!-- figures ", kInline = "<!-- figure ";

  std::size_t NextMark(std::size_t at) const { return std::min(text_.find(kBlock, at), text_.find(kInline, at)); }

  [[noreturn]] void Refuse(std::size_t at, const std::string& why) const {
    const auto line = 1 + std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(at), '\n');
    throw InputError(name_, fmt::format("line {}: {}", line, why));
  }

  // A row for each part, and their sum. Of the machine what comes before its compiler.
  std::vector<std::string_view> All() {
    all_ = {"| part | command | machine | version | minutes |", "|---|---|---|---|---|"};
    double seconds = 0;
    for (const auto& [name, part] : figures_) {
      all_.push_back(fmt::format("| {} | `{}` | {} | {} | {:.1f} |", name, part.command,
                                 part.machine.substr(0, part.machine.find(';')), part.version, part.seconds / 60));
      seconds += part.seconds;
    }
    all_.push_back(fmt::format("| all | | | | {:.0f} |", seconds / 60));
    return {all_.begin(), all_.end()};
  }

  // "PART: HEADING" -> the lines below it.
  std::vector<std::string_view> Find(std::size_t mark, std::string_view what) const {
    const std::size_t colon = what.find(':');
    const std::string_view part = Trimmed(what.substr(0, colon)),
                           heading = colon == std::string_view::npos ? "" : Trimmed(what.substr(colon + 1));
    const auto found = figures_.find(std::string(part));
    if (found == figures_.end()) Refuse(mark, fmt::format("docs/figures.json has no part '{}'", part));
    std::optional<std::vector<std::string_view>> lines = Below(found->second, heading);
    if (!lines) Refuse(mark, fmt::format("part '{}' has no heading '{}'", part, heading));
    return *std::move(lines);
  }

  static std::string Joined(const std::vector<std::string_view>& lines) {
    return fmt::format("{}", fmt::join(lines, "\n"));
  }

  std::string Block(std::size_t mark, std::string_view what) {
    return Joined(Trimmed(what) == "all" ? All() : Find(mark, what));
  }

  std::string Number(std::size_t mark, std::string_view what) const {
    const std::size_t tilde = what.find(" ~ ");
    if (tilde != std::string_view::npos) {
      const std::string lines = Joined(Find(mark, what.substr(0, tilde)));
      const std::string expression(Trimmed(what.substr(tilde + 3)));
      std::smatch match;
      try {
        if (std::regex_search(lines, match, std::regex(expression, std::regex::ECMAScript | std::regex::multiline)) &&
            match.size() > 1)
          return match[1].str();
      } catch (const std::regex_error&) {
        Refuse(mark, fmt::format("'{}' is no regular expression", expression));
      }
      Refuse(mark, fmt::format("nothing printed matches '{}'", expression));
    }
    const std::vector<std::string_view> asked = Split(what, " | ");
    if (asked.size() != 3 && asked.size() != 4) Refuse(mark, "PART: HEADING | ROW | COLUMN [| DECIMALS] is wanted");
    std::optional<std::string> cell = Cell(Find(mark, asked[0]), asked[1], asked[2]);
    if (!cell) Refuse(mark, fmt::format("no row '{}' with a column '{}'", asked[1], asked[2]));
    if (asked.size() == 4) cell = Rounded(*cell, asked[3]);
    if (!cell) Refuse(mark, fmt::format("row '{}', column '{}' is no number", asked[1], asked[2]));
    return *cell;
  }

  std::string_view text_;
  const std::string& name_;
  const PrintedFigures& figures_;
  std::vector<std::string> all_;
};

}  // namespace

PrintedFigures ReadPrintedFigures(const std::filesystem::path& file) {
  PrintedFigures figures;
  if (!std::filesystem::exists(file)) return figures;
  try {
    const nlohmann::json json = nlohmann::json::parse(OpenToRead(file));
    for (const auto& [name, part] : json.at("parts").items())
      figures[name] = {part.at("command"), part.at("machine"), part.value("version", ""), part.at("seconds"),
                       part.at("printed")};
  } catch (const nlohmann::json::exception& e) {
    throw InputError(file, e.what(), "take the file of the repository again");
  }
  return figures;
}

std::vector<std::string> WithoutRoot(std::vector<std::string> lines, const std::filesystem::path& root) {
  const std::string folder = std::filesystem::absolute(root).lexically_normal().string();
  const std::string prefix = folder.ends_with('/') ? folder : folder + "/";
  for (std::string& line : lines)
    for (std::size_t at; (at = line.find(prefix)) != std::string::npos;) line.erase(at, prefix.size());
  return lines;
}

std::string ToJson(const PrintedFigures& figures) {
  nlohmann::ordered_json parts = nlohmann::ordered_json::object();
  for (const auto& [name, part] : figures)
    parts[name] = {{"command", part.command},
                   {"machine", part.machine},
                   {"version", part.version},
                   {"seconds", part.seconds},
                   {"printed", part.lines}};
  return nlohmann::ordered_json{
             {"about", "what ./bench.sh printed last, part by part; ./bench.sh --update-docs writes it"},
             {"parts", parts}}
             .dump(1) +
         "\n";
}

std::vector<std::filesystem::path> PagesWithFigures(const std::filesystem::path& root) {
  std::vector<std::filesystem::path> pages{root / "README.md"};
  for (const auto& entry : std::filesystem::directory_iterator(root / "docs"))
    if (entry.path().extension() == ".md") pages.push_back(entry.path());
  std::sort(pages.begin(), pages.end());
  return pages;
}

std::string FillInFigures(const std::string& markdown, const std::string& name, const PrintedFigures& figures) {
  return Filler(markdown, name, figures).Fill();
}

}  // namespace lumi
